"""The speed tables: ratios measured on this machine in one go, beside their targets."""

import os
import platform
import time

import callback
import magnetised
import minimal
import mujoco
import startup
import threads
import throughput

TOPICS = (magnetised, callback, minimal, threads, startup, throughput)


def main() -> None:
    begin = time.perf_counter()
    load = ", ".join(f"{x:.1f}" for x in os.getloadavg())
    print(f"MuJoCo {mujoco.__version__}, Python {platform.python_version()}, {os.cpu_count()} CPUs,")
    print(f"load before the start {load}. Times are minima over turns: noise only adds.")
    for topic in TOPICS:
        topic.main()
    print(f"\n{time.perf_counter() - begin:.0f} s in all")


if __name__ == "__main__":
    main()
