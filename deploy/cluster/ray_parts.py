#!/usr/bin/env python3
"""Makes a dataset in N parts on a Ray cluster with a shared folder, and joins them.

    python3 deploy/cluster/ray_parts.py CONFIG.toml OUT N [--uw PATH] [--address auto] [--threads 1]

A part whose worker dies is started again elsewhere and goes on where it stopped. CONFIG.toml, OUT and PATH are seen
from here and must be the same files on every machine; so must UWGUIDE_ASSETS, which is handed on.
"""
import argparse
import os
import shutil
import subprocess

import ray


@ray.remote(max_retries=3, retry_exceptions=True)
def part(uw, config, out, index, parts, threads):
    command = [uw, "dataset", config, "-o", f"{out}/part-{index}", "--shard", f"{index}/{parts}"]
    subprocess.run([*command, "--threads", str(threads), "--quiet"], check=True)
    return index


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("config")
    parser.add_argument("out")
    parser.add_argument("parts", type=int)
    parser.add_argument("--uw", default="uw")
    parser.add_argument("--address", help="address of a running cluster; without it one is started here")
    parser.add_argument("--threads", type=int, default=1)
    a = parser.parse_args()
    uw = shutil.which(a.uw)
    if uw is None:
        parser.error(f"--uw: there is no program {a.uw}")
    # A worker has its own working folder, and its environment is that of whoever started the cluster.
    uw, config, out = (os.path.abspath(path) for path in (uw, a.config, a.out))
    handed_on = {name: os.path.abspath(os.environ[name]) for name in ["UWGUIDE_ASSETS", "UW_ASSETS"] if name in os.environ}
    ray.init(address=a.address, runtime_env={"env_vars": handed_on})
    remote = part.options(num_cpus=a.threads)
    waiting = [remote.remote(uw, config, out, i, a.parts, a.threads) for i in range(1, a.parts + 1)]
    while waiting:
        done, waiting = ray.wait(waiting)
        print(f"part {ray.get(done[0])} is done, {len(waiting)} left", flush=True)
    folders = [f"{out}/part-{i}" for i in range(1, a.parts + 1)]
    subprocess.run([uw, "dataset", config, "-o", out, "--merge", *folders], check=True)


if __name__ == "__main__":
    main()
