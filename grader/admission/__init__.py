"""What may begin on this machine now: starts, one per core, and runs that nothing else may disturb.

All graders of one user agree through locked files in one folder, so two batches, or a batch and a test, get in each
other's way no more than the submissions of one batch. The kernel opens a lock when its holder ends, however it ends.
"""

from grader.admission.admission import Admission, Leave
from grader.admission.folder import shared_folder

__all__ = ["Admission", "Leave", "shared_folder"]
