"""Shared by the examples: the command line, and saving pictures and movies."""

import sys
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import matplotlib
import tyro
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy import array, asarray, uint8, vstack
from numpy.typing import ArrayLike, NDArray

import magmotor as mm

# isort: split
# MuJoCo comes after magmotor, which selects the OpenGL backend that MuJoCo loads.
import mujoco

matplotlib.rcParams.update(mm.plots.STYLE)  # also the colors C0 to C5

FRAME_RATE = 20
"""frames of a movie per second"""


def run(main: Callable[..., None]) -> None:
    """Run `main` with its parameters as flags; errors and Ctrl-C end it with one line."""
    name = Path(sys.argv[0]).name
    try:
        tyro.cli(main, description=sys.modules[main.__module__].__doc__)
    except KeyboardInterrupt:
        print(f"{name}: interrupted, nothing written", file=sys.stderr)
        raise SystemExit(130) from None
    except (ImportError, OSError, ValueError) as error:
        print(f"{name}: {error}", file=sys.stderr)
        raise SystemExit(2) from None


def save(figure: Figure, path: Path) -> None:
    """Write a picture, whose suffix sets the format, as .png if its name has none."""
    path = path if path.suffix else path.with_name(f"{path.name}.png")
    path.parent.mkdir(parents=True, exist_ok=True)
    smaller: Any = {"pil_kwargs": {"optimize": True}} if path.suffix == ".png" else {}
    figure.savefig(path, dpi=80, **smaller)
    print(f"wrote {path}")


def film(frames: Iterable[NDArray[uint8]], path: Path) -> None:
    """Write pictures of equal shapes (height, width, 3) as a movie, as .mp4."""
    import imageio_ffmpeg
    import mediapy
    from tqdm import tqdm

    path = path.with_suffix(".mp4")
    path.parent.mkdir(parents=True, exist_ok=True)
    mediapy.set_ffmpeg(imageio_ffmpeg.get_ffmpeg_exe())
    pictures = list(tqdm(frames, "render", unit=" frames", leave=False, disable=None))
    mediapy.write_video(path, pictures, fps=FRAME_RATE, crf=22)
    print(f"wrote {path}")


def views(
    model: mujoco.MjModel, qpos: ArrayLike, camera: str, height: int, width: int
) -> Iterator[NDArray[uint8]]:
    """Yield pictures of positions, shape (n, nq), from a camera of the model."""
    data = mujoco.MjData(model)
    with mujoco.Renderer(model, height, width) as renderer:
        for data.qpos[:] in asarray(qpos):
            mujoco.mj_kinematics(model, data)
            mujoco.mj_camlight(model, data)
            renderer.update_scene(data, camera)
            yield renderer.render()


def pixels(figure: Figure) -> NDArray[uint8]:
    """Return a figure as a picture, shape (height, width, 3)."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return array(canvas.buffer_rgba())[:, :, :3]


def titled(pictures: Iterable[NDArray[uint8]], title: str) -> Iterator[NDArray[uint8]]:
    """Yield pictures below a title."""
    line = None
    for picture in pictures:
        if line is None:
            figure = Figure(figsize=(picture.shape[1] / 100, 0.4), dpi=100)
            figure.text(0.5, 0.5, title, ha="center", va="center")
            line = pixels(figure)
        yield vstack([line, picture])
