"""The speed tables: ratios measured on this machine in one go, beside their targets."""

import os
import platform
import time

import magmotor as mm

# isort: split
# Above, magmotor chose who draws, as it can until MuJoCo is imported.
import anatomy
import callback
import disk_mujoco
import ensemble
import fixed_cost
import magnetised
import minimal
import mujoco
import mujoco_baoab
import rigid
import startup
import sweeps
import threads
import throughput

TOPICS = (
    magnetised,
    callback,
    minimal,
    anatomy,
    threads,
    startup,
    fixed_cost,
    throughput,
    disk_mujoco,
    mujoco_baoab,
    ensemble,
    rigid,
    sweeps,
)


def main() -> None:
    begin = time.perf_counter()
    python, cpus, load = platform.python_version(), os.cpu_count(), os.getloadavg()[0]
    print(f"magmotor {mm.__version__}, MuJoCo {mujoco.__version__}, Python {python}.")
    print(f"{cpus} CPUs, of which {load:.1f} were busy in the last minute.")
    print("Times are minima over turns: what disturbs only adds. Noisy rows want another run.")
    for topic in TOPICS:
        topic.main()
    print(f"\n{time.perf_counter() - begin:.0f} s in all")


if __name__ == "__main__":
    main()
