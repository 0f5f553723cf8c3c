"""How estimators of human pose, and collections of motions, lay their files out: whom they see, and what they tell of
each.

Where each layout is defined is said at its function.
"""

from __future__ import annotations

from dataclasses import replace

from mrhubo.files.tree import Tree
from mrhubo.motion.readers.detections import read_cliff, read_pymaf
from mrhubo.motion.readers.family import family_of
from mrhubo.motion.readers.frame_layouts import read_phalp, read_romp
from mrhubo.motion.readers.frame_lists import (
    read_clips,
    read_columns,
    read_frame_list,
    read_listed,
    read_numbered,
    read_pictures,
)
from mrhubo.motion.readers.key_words import model_named
from mrhubo.motion.readers.other_rotations import read_egoallo, read_six
from mrhubo.motion.readers.people import has_twins, people_in
from mrhubo.motion.readers.rotations import find_form
from mrhubo.motion.readers.simulated import read_mimickit_smpl, read_protomotions
from mrhubo.motion.readers.smpl_names import Found, clips_in, find_here, find_inside, forms_in, search
from mrhubo.motion.readers.tracks import Kind, Layout, SmplArrays, Track
from mrhubo.motion.readers.world import ANY_WORLD, CAMERAS, Y_UP

_MESHCAPADE = {0: "smpl", 1: "smplh", 2: "smplx"}
"""The models of `smplVersion` (https://pypi.org/project/smplcodec, codec.py)."""
_TRACKS, _IDS = ("tracks", "people", "persons", "subjects", "tracklets"), ("track_id", "person_id", "id", "name")
_MOST_TRACKS = 1_000
"""What files call a list of people, and people themselves."""
_OF_SMPL, _OF_BODY = (23, 24), 21
"""How many joints SMPL's poses have, and those of a body without hands."""


def find_layout(tree: Tree) -> Layout | None:
    """The layout of a file; None where nobody knows it."""
    for find in _FINDERS:
        layout = find(tree)
        if layout is not None:
            return layout
    return None


def _people(tree: Tree) -> Layout | None:
    """WHAM, and VIBE and its kin: a dictionary of people, each with arrays over the frames in which they are seen.

    `joblib.dump(results, ...)` of https://github.com/yohanshin/WHAM/blob/main/demo.py: `pose_world` (T, 72) and
    `trans_world` (T, 3) in the world, `pose` and `trans` as the camera sees them, `betas`, `frame_ids`. Those of
    https://github.com/mkocabas/VIBE/blob/master/demo.py have `pose`, and no world. PromptHMR has `people`, each with
    `frames`, and `pose` (T, 165), `shape` and `trans` in `smplx_world` and `smplx_cam`
    (https://github.com/yufu-wang/PromptHMR).
    """
    people = None if has_twins(tree) else search(tree, people_in, deepest=1)
    if people is None:
        return None
    _, first = people.found[0]
    kind = _kind("SMPL parameters of people", first, first.node)
    if first.node is not first.outer and first.node.where.endswith(("_cam]", "_incam]")):
        kind = replace(kind, worlds=CAMERAS)
    kind, notes = _taken_for(kind, first)
    return Layout(kind, people.tracks, (*people.notes, *notes))


def _tracks(tree: Tree) -> Layout | None:
    """A list of people, itself or under a key, each a dictionary with arrays over the frames in which they are seen."""
    listed = tree if tree.is_list else tree.get(*_TRACKS) if tree.is_mapping else None
    if listed is None or not listed.is_list or not 0 < len(listed) <= _MOST_TRACKS:
        return None
    people = list(listed)
    found = [find_here(person) for person in people]
    if None in found or all(one is None or one.frames < 2 for one in found):  # of single frames, they are of one
        return None
    told = [person.get(*_IDS) for person in people]
    names = ["" if one is None else one.text() or f"{one.number():.0f}" for one in told]
    unique = all(names) and len(set(names)) == len(names)
    return _people(listed.by_names(names if unique else [str(number) for number in range(len(names))]))


def _single(tree: Tree) -> Layout | None:
    """SMPL parameters of one person, or with an axis for people, somewhere in the file.

    TRAM: `np.save` of a dictionary, `pred_rotmat` (T, 24, 3, 3), `pred_trans` (T, 1, 3), `frame`, as the camera sees it
    (https://github.com/yufu-wang/tram/blob/main/scripts/estimate_humans.py). GVHMR: `smpl_params_global` and
    `smpl_params_incam`, of SMPL-X (https://github.com/zju3dv/GVHMR/blob/main/tools/demo/demo.py). GENMO and GEM:
    `body_params_global` (https://github.com/NVlabs/GENMO). Their world is what they call `ay`, with y up. AIST++,
    EDGE, SLAHMR, EMDB, GRAB, PHC and others: see `mrhubo.motion.readers.smpl_names`.
    """
    found = find_inside(tree)
    if found is None:
        return None
    keys = set(found.node.keys)
    if "params_global" in found.node.where or "params_incam" in found.node.where:
        name = "GVHMR" if "smpl_params" in found.node.where else "GENMO or GEM"
        worlds = CAMERAS if "incam" in found.node.where else Y_UP
        return Layout(Kind(name, "smplx", worlds), found.tracks())
    if "pred_rotmat" in keys:
        return Layout(Kind("TRAM", "smpl", CAMERAS), found.tracks(), camera_beside=True)
    if found.names.pose == "local_rot_mats":
        return Layout(Kind("Kimodo with SMPL-X's skeleton", "smplx", ANY_WORLD), found.tracks())
    if "pred_thetas" in keys:
        return Layout(Kind("HybrIK", "smpl", CAMERAS), found.tracks())
    if "smpl_scaling" in keys:
        return Layout(Kind("AIST++", "smpl", ANY_WORLD), found.tracks())
    kind, notes = _taken_for(_kind("SMPL parameters", found, tree), found)
    return Layout(kind, found.tracks(), notes)


def _clips(tree: Tree) -> Layout | None:
    """Lists with an array a clip, which go by their numbers."""
    found = clips_in(tree)
    if len(found) < 2 or any(one.frames < 2 for one in found):  # of single frames, they are of one
        return None
    kind, notes = _taken_for(_kind("SMPL parameters of clips", found[0], tree), found[0])
    return Layout(kind, [track for number, one in enumerate(found) for track in one.tracks(str(number))], notes)


def _pair(tree: Tree) -> Layout | None:
    """A pose and a place of the root, as `torch.save((pose, tran), ...)` keeps what TransPose and its kin answer: all
    joints of SMPL (T, 24, 3) or (T, 24, 3, 3), and (T, 3) (https://github.com/Xinyu-Yi/TransPose).
    """
    pair = list(tree) if tree.is_list and len(tree) == 2 else []
    pose, place = (node.shape() for node in pair) if pair else (None, None)
    if pose is None or place is None or len(pose) < 2 or place != (pose[0], 3):
        return None
    form = find_form(pose, (24,))
    if form is None:
        return None

    def read() -> SmplArrays:
        return SmplArrays(pair[0].where, pair[0].array(), form, 1, None, pair[1].array())

    return Layout(Kind("SMPL's pose and place", "smpl", ANY_WORLD), [Track("", pose[0], read)])


_FINDERS = (
    read_protomotions, read_mimickit_smpl, read_phalp, read_romp, read_frame_list, read_pictures, read_pymaf,
    read_cliff, read_six, read_egoallo, _pair, _tracks, read_columns, _clips, _people, _single, read_listed,
    read_numbered, read_clips,
)  # fmt: skip


def _kind(source: str, found: Found, tree: Tree) -> Kind:
    """What is known of parameters: by their keys whose they are, or else by what the file says."""
    of_smpl = found.form.joints in _OF_SMPL  # who writes as they do for another model has more joints
    if of_smpl and "pose_world" in found.node.keys:
        return Kind("WHAM", "smpl", ANY_WORLD)
    if of_smpl and {"pred_cam", "orig_cam"} & set(found.node.keys):
        return Kind("VIBE or one of its kin", "smpl", CAMERAS)
    said = next((text for node in (found.node, tree) if (text := _said(node))), "") or model_named(found.pose.where)
    keys = {*found.node.keys, *tree.keys}
    family = family_of(said, found.form.joints, keys, found.shape())
    # a pose of the body alone may be told beside that of all joints, whose number tells the model
    family = family or next(
        (name for form in forms_in(found.node) if (name := family_of("", form.joints, (), None))), ""
    )
    return Kind(source, family, ANY_WORLD)


def _taken_for(kind: Kind, found: Found) -> tuple[Kind, tuple[str, ...]]:
    """The same, of SMPL-X where nothing tells the model of a body's 21 joints under the names of the package smplx, as
    most estimators that write those are of SMPL-X; and a note that says so.
    """
    said = "smpl" in found.pose.where.lower()  # what is called so may be of all models
    if kind.family or said or found.names.pose != "body_pose" or found.form.joints != _OF_BODY:
        return kind, ()
    note = "which body model it is of is not told: 21 joints as 'body_pose' are taken for SMPL-X's"
    return replace(kind, family="smplx"), (note,)


def _said(node: Tree) -> str:
    """What a file calls its body model, or the dictionary in it that has the parameters: `smplx`, `smplh_params`, but
    not `smpl`, as those of all models are called.
    """
    model, version = node.get("surface_model_type", "model_type", "smpl_type", "body_model"), node.get("smplVersion")
    if version is not None:
        return _MESHCAPADE.get(int(version.number()), "")
    return model_named(node.where) if model is None else model.text() or ""
