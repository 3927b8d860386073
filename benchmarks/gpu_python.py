"""ist.penetration of solids on a GPU beside what the device itself does of it, and ist.torch.overlap.

    PYTHONPATH=build/python python3 benchmarks/gpu_python.py FOLDER

FOLDER: elephant.ist and dino.ist of 4,000 spheres, and poses_eledino.csv: the rows of gpu_batch.
Writes a row of JSON a class of poses and a size. "device" is by CUDA's events around ten calls into the
same arrays, what that program measures of the C++ batch; "wall" is from the first call to the end of
the last; "call" is how long a call keeps the host, with the device busy.
"""
import csv
import json
import pathlib
import sys
import time

import numpy as np
import torch

import ist
from ist.torch import overlap


def measure(folder):
    elephant, dino = (ist.Asset.load(folder / f"{name}.ist") for name in ("elephant", "dino"))
    with open(folder / "poses_eledino.csv") as file:
        rows = [row for row in csv.DictReader(file)]
    assets = ist.Solids([elephant, dino], device="cuda")
    for kind in ("pen", "deep", "contain", "sep"):
        columns = "qw qx qy qz tx ty tz scale_b".split()
        table = np.array([[float(row[c]) for c in columns] for row in rows if row["class"] == kind])
        for count in (1_000_000, 4096):
            drawn = torch.from_numpy(table[np.random.default_rng(1).integers(0, len(table), count)]).cuda()
            poses, scales = drawn[:, :7].contiguous(), drawn[:, 7].contiguous()
            numbers = [torch.full((count,), k, dtype=torch.int32, device="cuda") for k in (0, 1)]
            sides = [assets[number] for number in numbers]
            kept = ist.penetration(*sides, poses, scales=scales, spheres_only=True)
            torch.cuda.synchronize()
            row = dict(poses=kind, pairs=count)
            for name, out in (("into the same arrays", kept), ("into new arrays", None)):
                device, wall, call = [], [], []
                for _ in range(10):
                    events = [torch.cuda.Event(enable_timing=True) for _ in range(2)]
                    start = time.perf_counter()
                    events[0].record()
                    for _ in range(10):
                        before = time.perf_counter()
                        found = ist.penetration(*sides, poses, scales=scales, spheres_only=True, out=out)
                        call.append(time.perf_counter() - before)
                    events[1].record()
                    torch.cuda.synchronize()
                    wall.append((time.perf_counter() - start) / 10)
                    device.append(events[0].elapsed_time(events[1]) / 10)
                row[name] = {"device, ms": np.median(device), "wall, ms": 1e3 * np.median(wall),
                             "call, µs": 1e6 * np.median(call),
                             "M/s": count / np.median(wall) * 1e-6}
            if count == 4096:
                scene = torch.zeros(count, 2, 7, dtype=torch.float64, device="cuda")
                scene[:, 0, 0] = 1
                scene[:, 1] = poses
                sizes = torch.stack((torch.ones_like(scales), scales), dim=1)
                scene.requires_grad_()
                times = []
                for _ in range(20):
                    torch.cuda.synchronize()
                    start = time.perf_counter()
                    overlap(assets, scene, scales=sizes, spheres_only=True).sum().backward()
                    torch.cuda.synchronize()
                    times.append(time.perf_counter() - start)
                row["ist.torch.overlap and backward, ms"] = 1e3 * np.median(times)
            cpu = ist.penetration(elephant, dino, poses[:2000].cpu().numpy(),
                                  scales=scales[:2000].cpu().numpy(), spheres_only=True).volume
            ours = torch.from_dlpack(kept.volume)[:2000].cpu().numpy()
            row["largest difference to the CPU"] = float(
                np.max(np.abs(ours - cpu) / np.maximum(np.maximum(ours, cpu), 1e-300)))
            print(json.dumps(row, ensure_ascii=False), flush=True)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    measure(pathlib.Path(sys.argv[1]))
