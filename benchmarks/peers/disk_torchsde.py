"""The disk with torchsde, on one thread."""

import warnings

import torch  # pyright: ignore[reportMissingImports]
import torchsde  # pyright: ignore[reportMissingImports]

torch.set_num_threads(1)
torch.set_default_dtype(torch.float64)
warnings.simplefilter("ignore")  # by rounding, the last step ends beyond the path's end

SIGMA, FRICTION, NOISE, H = 0.5, 0.1, 5.0, 0.01
STEPS = 200


class Disk(torch.nn.Module):
    noise_type, sde_type = "additive", "ito"

    def __init__(self, replicas: int):
        super().__init__()
        column = torch.tensor([0.0, 0.0, NOISE, NOISE / SIGMA])
        self.noise = column.reshape(1, 4, 1).repeat(replicas, 1, 1)

    def f(self, t, y):
        x, _, v, omega = y.unbind(1)
        force = -FRICTION * (v + omega)
        return torch.stack([v, omega, force - torch.cos(x), force / SIGMA], 1)

    def g(self, t, y):
        return self.noise


@torch.inference_mode()
def run(replicas: int):
    end = STEPS * H
    path = torchsde.BrownianInterval(0.0, end, size=(replicas, 1), dtype=torch.float64, dt=H)
    start, times = torch.zeros(replicas, 4), torch.tensor([0.0, end])
    return torchsde.sdeint(Disk(replicas), start, times, bm=path, method="euler", dt=H)


PEERS = {"torchsde": (run, (4096, 8192, 16384), STEPS)}
"""See server.py."""
