"""The scale factor and the pairs in a fit's run: numbers and pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mrhubo.fitting.preparation import prepare
from mrhubo.fitting.record.recording import Recording
from mrhubo.pairing import PairFilter
from mrhubo.runtime.runs import log_all
from mrhubo.view import phi_histogram

if TYPE_CHECKING:
    from mrhubo.callbacks import ScaleResult
    from mrhubo.fitting.training import Training


def log_scale(recording: Recording, found: ScaleResult) -> None:
    """The scale factor that was found; from here on the run is that of the config with it."""
    recording.go_on_with(prepare(found.config))
    numbers = {f"scale_factor/{name}": value for name, value in found.values.items()}
    log_all(recording.client, recording.run_id, {}, numbers)
    for name, picture in found.pictures.items():
        recording.log_picture(picture, f"scale/{name}.png")


def log_pairs(recording: Recording, training: Training) -> None:
    """Metrics and pictures of the pairs that a network was trained on."""
    pairs, pair_filter, pairing = training.pairs, training.filter, training.pairing
    count, reverse_P = len(pairs["phi"]), pairs["reverse"]
    metrics = {"pairs/count": float(count), "pairs/reverse_share": float(reverse_P.float().mean())}
    if bool(reverse_P.any()):
        metrics["pairs/reverse_residual_mm"] = 1000 * float(pairs["residual_m"][reverse_P].mean())
    if not bool(reverse_P.all()):  # phi and the filter are about the human poses that were made for robot poses
        pairs = {name: tensor[~reverse_P] for name, tensor in pairs.items()}
        pair_filter = PairFilter(pair_filter.probability_P[~reverse_P], pair_filter.threshold)
    metrics |= {
        "pairs/kept_share": pair_filter.kept_share,
        "pairs/mean_probability": float(pair_filter.probability_P.mean()),
        "pairs/ik_cost": float(pairs["cost"].mean()),
        "pairs/ik_residual_mm": 1000 * float(pairs["residual_m"].mean()),
        "pairs/phi_mean": float(pairs["phi"].mean()),
        "pairs/phi_threshold": pair_filter.threshold,
    }
    if pairing.made:
        metrics["pairs/per_second"] = pairing.made / pairing.seconds
    recording.logger.log_metrics(metrics)
    recording.log_picture(phi_histogram(pairs["phi"].numpy(), pair_filter.threshold), "pairs/phi_histogram.png")
    sheet = recording.artist.pairs(pairs, pair_filter, training.prepared.prior)
    recording.log_picture(sheet, "pairs/feasible_and_extreme.png")
