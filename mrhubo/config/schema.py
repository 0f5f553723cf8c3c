"""The settings of a run, one dataclass per section of the YAML. The text under each field is what ``--help`` prints."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from mrhubo.config.entries import KeypointEntry, ManualEntry, Range, Vector
from mrhubo.config.fields import bounded, choice


@dataclass
class ManualScaleConfig:
    """The numbers of `robot.scale: manual`, in the robot's base frame (x forward, y left, z up)."""

    keypoints: dict[str, ManualEntry]
    """Where each human keypoint is: a link name, {link: NAME, offset: [x, y, z]} (m), {links: {NAME: WEIGHT, ...},
    offset: ...} for a weighted mean, or {offset: ...} for a constant. Names: SMPL's body joints, and `left_` and
    `right_` `eye`, `thumb`, `index`, `middle`, `pinky`, `toe`, `heel`. `pelvis` is needed."""
    upper_arm: float = bounded(0.0, -0.9, 100.0)
    """Extra length of the upper arm, as a share of the robot's."""
    forearm: float = bounded(0.0, -0.9, 100.0)
    """Extra length of the forearm, as a share of the robot's."""
    shift: Vector = field(default_factory=lambda: [0.0, 0.0, 0.0])
    """Added to every keypoint, [x, y, z], m."""
    factor: float = bounded(1.0, 1e-3, 1e3)
    """Everything is multiplied by it, after the shift."""


@dataclass
class ScaleSearchConfig:
    """The search of `robot.scale: search`: which numbers of `manual` vary."""

    ranges: dict[str, Range]
    """What varies, [low, high]: `factor`, `upper_arm`, `forearm`, and in m `KEYPOINT.x`, `.y` or `.z`, added to the
    offset of a keypoint of `manual`; `shoulder.z` without a side moves both, `.y` apart from each other. `pelvis.z`
    is the height of all others (the paper's shift)."""
    trials: int = bounded(200, 1, 1_000_000)
    """Draws of the numbers."""
    sampler: str = choice("tpe", "tpe", "random", "cmaes")
    """Who draws: `tpe` (tree-structured Parzen estimator), `random` (the paper), or `cmaes`."""
    poses: int = bounded(200, 10, 100_000)
    """Human poses of the validation clips that they are measured on, with the reference retargeter's answers."""
    seed: int = bounded(0, 0, 2**32 - 1)
    """Seed of the draws."""


@dataclass
class RobotConfig:
    """The robot: its URDF, which joints move, and which links stand for which part of the human body."""

    name: str
    """Short name of the robot; runs and packages are named after it."""
    urdf: Path
    """URDF file; a relative path is relative to the YAML that names it."""
    joints: list[str]
    """Joints that are sampled and predicted, by URDF name; their order is the order of the output."""
    keypoints: dict[str, KeypointEntry]
    """Which link stands for which part of the human body. Points: `left_` and `right_` `shoulder`, `elbow`, `wrist`,
    each a link name or {link: NAME, offset: [x, y, z]} (m, in that link's frame). `chest`: the link that carries the
    arms, with optional `forward` and `up` (default [1, 0, 0] and [0, 0, 1]). Optional `left_hand` and `right_hand`:
    {link: NAME, fingers: [x, y, z], thumb: [x, y, z]}, where the fingers point and the thumb lies, in that link's
    frame. Optional `head`: a link name or {link: NAME, forward: ..., up: ...}."""
    key_links: list[str]
    """Links whose position error is the link error."""
    ranges: dict[str, Range] = field(default_factory=dict)
    """Ranges narrower than the URDF's limits, [lower, upper] in rad, by joint name."""
    hold: dict[str, float] = field(default_factory=dict)
    """Angles in rad at which joints outside `joints` are held; default 0, clamped to the joint's limits."""
    unsure: list[str] = field(default_factory=list)
    """What `mrhubo describe` could not decide, by the entry that holds its best guess (`chest`, `left_hand`). Take
    a name out when you have looked at the entry: until then nothing is trained, or, for a hand or head, with a
    warning."""
    max_speed: float = bounded(12.0, 0.01, 1_000.0)
    """No joint of a motion turns faster [rad/s], nor faster than its limit in the URDF, where that tells one (it does
    not where it is 0). The default is 0.5 rad in 1/24 s, from where on a step counts as a jump."""
    root_follows: str = choice("pelvis", "pelvis", "chest", "between", left_out=True)
    """How the base of a robot with feet is turned, where its waist cannot do what the person's back does: `pelvis` = as
    the person's pelvis; `chest` = so that the robot's chest is turned as the person's, as far as its legs let it;
    `between` = half-way from one to the other."""
    balance: float = bounded(0.0, 0.0, 1.0, left_out=True)
    """How much a robot with feet keeps its centre of mass over planted soles in whole motions, while the person stands
    still: 0 = nothing looks at it, 1 = all the way. The URDF has to tell masses."""
    scale: str = choice("auto", "auto", "manual", "search")
    """How lengths are matched: `auto` keeps the robot's limb directions and gives each limb the human's length;
    `manual` takes the numbers of `manual` (the paper); `search` looks for better ones first, as `search` says."""
    manual: ManualScaleConfig | None = None
    """Numbers for `scale: manual`, and what `scale: search` departs from."""
    search: ScaleSearchConfig | None = None
    """Ranges for `scale: search`."""


@dataclass
class BodyConfig:
    """The human: body prior and skeleton. docs/official-files.md tells about VPoser, SMPL-X, SMPL and SMPL-H."""

    prior: str = choice("open", "open", "vposer")
    """Which prior: `open` ships with mrhubo; `vposer` is VPoser v2, for those who have it."""
    prior_path: Path | None = None
    """For `open`: weights file (.safetensors) in place of the shipped one. For `vposer`: its folder V02_05, or the
    snapshot in it."""
    model_path: Path | None = None
    """Body model whose skeleton takes the place of ours: SMPL-X (.npz), SMPL or SMPL-H (.pkl, .npz)."""
    betas: list[float] = field(default_factory=list)
    """Shape of that body: its first coefficients; those left out are 0."""


@dataclass
class PairsConfig:
    """The generated pairs of robot pose and human pose."""

    count: int = bounded(50_000, 100, 10_000_000_000)
    """Number of pairs."""
    dir: Path | None = None
    """Folder for the pairs; default `data/pairs` in the project. Every pairing config gets a folder of its own in
    it."""
    seed: int = bounded(0, 0, 2**63 - 1)
    """Seed of the robot poses and of the amortised solver's training."""
    solver: str = choice("auto", "auto", "direct", "fine", "fast", "paper")
    """How the human pose of a robot pose is found. `direct` = a person at rest whose limbs, hands, feet and head point
    where the robot's do; nothing is searched for. The others are latent inverse kinematics: `fine` = amortised start,
    then a quasi-Newton search of every pose; `fast` = amortised only; `paper` = L-BFGS over 500 poses, up to 500
    iterations, strong Wolfe. `auto` = `direct` where the rest of the pose counts nowhere (`align: true`, `phi: read`,
    `model.input_frame: directions`, `robot.scale: auto`), else `fine`."""
    reverse_share: float = bounded(0.5, 0.0, 1.0)
    """Share of the pairs that are made the other way: a human pose drawn from the prior, retargeted to the robot by
    optimisation. They teach what to do with poses that the robot cannot reach. 0 = robot poses only (the paper)."""
    reverse_spread: float = bounded(1.1, 0.1, 3.0)
    """Standard deviation of the latents that those human poses are decoded from."""
    random_share: float = bounded(0.2, 0.0, 1.0)
    """Share of those human poses that are drawn joint by joint instead, every direction of a limb alike, and not from
    the prior. They teach what no motion of the prior's data shows."""
    shard_size: int = bounded(2_500, 100, 1_000_000)
    """Pairs per file."""
    amortiser_steps: int = bounded(6_000, 10, 1_000_000)
    """Training steps of the amortised solver, once per robot."""
    fine_steps: int = bounded(100, 1, 10_000)
    """Most quasi-Newton steps per pose; a converged pose stops earlier."""
    workers: int = bounded(0, 0, 1_024)
    """Processes that make pairs, on a CPU; 0 = one a core. The pairs do not depend on it."""
    w_data: float = bounded(100.0, 0.0)
    """Weight of the squared keypoint distance, 1/m^2."""
    w_prior: float = bounded(0.001, 0.0)
    """Weight of the squared norm of the latent (VPoser's inverse kinematics, and so the paper: 0.01)."""
    align: bool = True
    """Turn the limbs, hands, feet and head that inverse kinematics found until they point exactly where the robot's do;
    cost and distances are of the pose before that. False = leave them where they are (the paper)."""
    phi: str = choice("read", "read", "all")
    """Of what phi is the reconstruction error: `read` = the pose as the robot reads it, a person at rest but for the
    parts that the robot has, and the joints that these turn; `all` = all joints of the pose that inverse kinematics
    found (the paper)."""
    filter: str = choice("linear", "linear", "hard", "none")
    """Use of phi: `linear` = drop above the threshold, then draw with a probability that falls linearly with phi (the
    paper); `hard` = drop above the threshold only; `none` = use every pair."""
    filter_k: float = bounded(1.0, -10.0, 100.0)
    """Threshold of phi in standard deviations above its mean."""


@dataclass
class ModelConfig:
    """The two networks."""

    start: str = choice("scratch", "scratch", "universal")
    """`scratch` = networks of the robot's own, from random weights. `universal` = the network that is the same for all
    robots, tuned to this one: far fewer steps, and a slower answer; the keys below are of no use then."""
    stages: int = bounded(2, 1, 2)
    """2 = human -> links -> joints (the paper), 1 = human -> joints directly."""
    hidden: int = bounded(160, 1, 8_192)
    """Width of the hidden layers, of each branch."""
    small_hidden: int = bounded(64, 1, 8_192)
    """The same of branches of three joints at most, such as a head or a waist, where it is less than `hidden`."""
    layers: int = bounded(4, 1, 64)
    """Hidden layers of each network (the paper's text: 1, its authors' code: 2)."""
    residual: bool = True
    """Add what comes in to what a hidden layer gives, from the second on; deep networks train far better so. False = a
    plain network (the paper)."""
    branches: bool = True
    """Give each part of the robot that turns apart from the others (an arm, the head) networks of its own, which see
    the human joints of that part alone. False = one network for the whole robot (the paper)."""
    input_joints: list[str] | None = None
    """Human joints that are read, with `input_frame: local`; default: those between the chest and the robot's
    keypoints."""
    input_frame: str = choice("directions", "directions", "local")
    """What of a human pose the networks see: `directions` = where limbs, hands, feet and head point, seen from the
    chest or the pelvis, the same however a file shares turns out among joints; `local` = the joints' local rotations
    (the paper)."""
    bound_output: str = choice("tanh", "tanh", "clamp")
    """How outputs are kept inside the joint limits: `tanh` squashes, `clamp` learns unbounded and cuts off."""
    detach_student: bool = False
    """Stop the student's gradient at the predicted links, as the authors' code does (the paper)."""


@dataclass
class TrainerConfig:
    """The training."""

    max_steps: int = bounded(6_000, 1, 1_000_000_000)
    """Optimiser steps; with `model.start: universal` 200."""
    batch_size: int = bounded(512, 1, 10_000_000)
    """Pairs per step; with `model.start: universal` 64."""
    loss: str = choice("l1", "l1", "mse")
    """Distance of links and joint angles from the pair's: `l1` = mean absolute, `mse` = mean square (the paper)."""
    optimizer: str = choice("muon", "muon", "adamw")
    """`muon`: hidden layers by Muon, all else by AdamW; `adamw`: all by AdamW, as it is with `model.start: universal`
    in any case."""
    lr: float = bounded(8e-3, 1e-9, 10.0)
    """Learning rate of AdamW; cosine decay to 0, after a warm-up of 2% of the steps. With `model.start: universal`
    0.001."""
    muon_lr: float = bounded(2e-2, 1e-9, 10.0)
    """The same of Muon."""
    weight_decay: float = bounded(1e-6, 0.0, 10.0)
    """Weight decay of AdamW."""
    precision: str = choice("32", "32", "bf16")
    """`32`, or `bf16` for bf16 autocast (faster, slightly less accurate)."""
    validate_every: int = bounded(500, 1, 1_000_000_000)
    """Steps between validations; a checkpoint is written at each. With `model.start: universal` 100."""
    seed: int = bounded(0, 0, 2**32 - 1)
    """Seed of the initial weights and of the draws."""
    accelerator: str = choice("auto", "auto", "cpu", "gpu")
    """Where to run."""


@dataclass
class EvaluationConfig:
    """The human motions that measure the result. They never enter the training."""

    motions: list[Path] = field(default_factory=list)
    """Folders of AMASS-style .npz files; the first that exists is used. Default: the eleven CMU clips in
    `data/external/cmu/evaluation`, else the motions that ship with mrhubo."""
    validation: list[str] = field(default_factory=lambda: ["13_28", "54_16", "directing_traffic", "drinking"])
    """Names of the clips of that folder that choose the checkpoint, each of which must be there; the others are the
    test clips. The default names those of both default folders."""
    smoothness: float = bounded(0.02, 0.0, 100.0)
    """Weight of the reference retargeter's temporal smoothness."""


@dataclass
class TrackingConfig:
    """MLflow."""

    dir: Path | None = None
    """Folder of the MLflow database, its artifacts, packages and unfinished runs; default `mlruns` in the project."""
    uri: str | None = None
    """URI of an MLflow tracking server; default: SQLite, `mlflow.db` in `dir`."""
    experiment: str = "mrhubo"
    """Experiment name."""
    run_name: str | None = None
    """Run name; default: the robot's name and what differs from the defaults."""


@dataclass
class Config:
    """Everything that a run depends on."""

    robot: RobotConfig
    body: BodyConfig = field(default_factory=BodyConfig)
    pairs: PairsConfig = field(default_factory=PairsConfig)
    model: ModelConfig = field(default_factory=ModelConfig)
    trainer: TrainerConfig = field(default_factory=TrainerConfig)
    evaluation: EvaluationConfig = field(default_factory=EvaluationConfig)
    tracking: TrackingConfig = field(default_factory=TrackingConfig)
