"""Settings of networks of all kinds, small ones, by the shipped robot that they are for."""

MODELS = {
    "nao": ["model.hidden=12"],
    "coman": [
        "model.hidden=9",
        "model.stages=1",
        "model.residual=false",
        "model.branches=false",
        "model.bound_output=clamp",
    ],
    "reachy": ["model.hidden=10", "model.small_hidden=6", "model.input_frame=local"],
}
