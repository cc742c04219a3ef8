"""Which public packages can be installed beside magmotor, and with which MuJoCo.

    python -m trials.corpus.beside [REQUIREMENTS] [--only NAME]

For each package, pip searches for versions of everything that both require, without installing
them. The program prints a table. Its exit code is 1 if the documentation's table (docs/install.md)
is another one.
"""

import argparse
import json
import re
import subprocess
import sys
from pathlib import Path

from trials.corpus.download import REQUIREMENTS

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "install.md"
SHOWN = "mujoco", "numpy"
NOT_BUILT = "pip cannot build one of its dependencies"
CONFLICT = re.compile(r"^ +(\S+ \S+ depends on .*|The user requested .*)$", re.MULTILINE)


def main() -> int:
    """Run the program; returns its exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m trials.corpus.beside", description=(__doc__ or "").split("\n")[0]
    )
    parser.add_argument("requirements", type=Path, nargs="?", default=REQUIREMENTS)
    parser.add_argument("--only", help="the name of one package")
    options = parser.parse_args()
    documented, wrong = rows_of(PAGE.read_text()), []
    print("| package | MuJoCo | NumPy | or why not |\n|---|---|---|---|")
    for package in packages_of(options.requirements):
        if options.only not in (None, package.partition("==")[0]):
            continue
        cells = [package.replace("==", " "), *beside(package)]
        print("|", " | ".join(cells), "|", flush=True)
        if documented.get(cells[0]) != cells[1:]:
            wrong.append(cells[0])
    for name in wrong:
        print(f"WRONG: {name}: the table in {PAGE.relative_to(ROOT)} says otherwise")
    return bool(wrong)


def packages_of(requirements: Path) -> list[str]:
    """Return the packages of a requirements file, with their versions."""
    lines = (line.partition("#")[0].strip() for line in requirements.read_text().splitlines())
    return [line for line in lines if line]


def beside(package: str) -> list[str]:
    """Return the versions of MuJoCo and NumPy that pip chooses, or why it finds none."""
    command = [
        sys.executable, "-m", "pip", "install", "--dry-run", "--ignore-installed", "--report", "-",
        "--quiet", "--quiet", str(ROOT), package,
    ]  # fmt: skip
    found = subprocess.run(command, capture_output=True, text=True)
    if found.returncode == 0:
        chosen = {
            each["metadata"]["name"].lower(): each["metadata"]["version"]
            for each in json.loads(found.stdout)["install"]
        }
        return [*(chosen.get(name, "") for name in SHOWN), ""]
    aloud = [argument for argument in command if argument != "--quiet"]
    explained = subprocess.run(aloud, capture_output=True, text=True)
    reasons = CONFLICT.findall(explained.stdout + explained.stderr) or [NOT_BUILT]
    return ["", "", "; ".join(re.sub(r" depends on ", ": ", reason) for reason in reasons)]


def rows_of(page: str) -> dict[str, list[str]]:
    """Return the rows of the documentation's table by package."""
    lines = page.partition("| package | MuJoCo |")[2].splitlines()[2:]
    rows = {}
    for line in lines:
        if not line.startswith("|"):
            break
        name, *cells = (cell.strip() for cell in line.strip("|").split("|"))
        rows[name] = cells
    return rows


if __name__ == "__main__":
    sys.exit(main())
