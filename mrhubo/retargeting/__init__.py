"""From files of human motion to files of robot motion."""

from mrhubo.retargeting.answering import Answerer, of_package, of_reference, of_universal
from mrhubo.retargeting.places import Places, find_files, plan_places
from mrhubo.retargeting.run import Outcome, Request, retarget_files
from mrhubo.retargeting.summary import Summary, table

__all__ = [
    "Answerer",
    "Outcome",
    "Places",
    "Request",
    "Summary",
    "find_files",
    "of_package",
    "of_reference",
    "of_universal",
    "plan_places",
    "retarget_files",
    "table",
]
