"""The body prior without a robot: plausible poses, how plausible a pose is, a pose from a few points.

    python examples/05_body_prior.py [OUT.png]

OUT is the picture to be drawn, by default body_prior.png.
"""

from __future__ import annotations

import sys

import torch

from mrhubo.body import BodyPrior, inverse_kinematics
from mrhubo.rotation import axis_angle_to_matrix, matrix_to_sixd, sixd_to_matrix
from mrhubo.view import figure_sheet, human_figure, save_png


def main(out: str = "body_prior.png") -> None:
    """Draws samples, spoilt and mended poses, and poses whose left hand was told where to be."""
    prior = BodyPrior.open()
    generator = torch.Generator().manual_seed(0)
    poses = prior.decode_matrices(torch.randn(5, prior.latent, generator=generator))

    turns = axis_angle_to_matrix(0.4 * torch.randn(5, 21, 3, generator=generator))  # each joint by some 0.6 rad
    spoilt = poses @ turns
    mended = sixd_to_matrix(prior.denoise(matrix_to_sixd(spoilt)))  # the prior takes and gives 6D
    for name, some in (("sampled", poses), ("spoilt", spoilt), ("mended", mended)):
        phi = prior.reconstruction_error(matrix_to_sixd(some))
        print(f"{name}: reconstruction error {float(phi.mean()):.4f} on average")

    heights = torch.linspace(-0.2, 0.6, 5)
    goals = torch.stack([torch.tensor([0.4, float(height), 0.3]) for height in heights])  # m from the pelvis
    reaching = sixd_to_matrix(inverse_kinematics(prior, {"left_wrist": goals}))

    rows = [[human_figure(pose) for pose in some] for some in (poses, spoilt, mended, reaching)]
    titles = ["sampled", "spoilt", "mended", "left hand\nhigher and higher"]
    save_png(figure_sheet(rows, titles=titles), out)
    print(f"written: {out}")


if __name__ == "__main__":
    if len(sys.argv) > 2:
        sys.exit(__doc__)
    main(*sys.argv[1:])
