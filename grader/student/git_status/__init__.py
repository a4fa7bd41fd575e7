"""What of a package is not committed or not pushed: asked of git without the network, and told as advice."""

from grader.student.git_status.ask import Asked, ask
from grader.student.git_status.environment import Surroundings, surroundings
from grader.student.git_status.messages import standing
from grader.student.git_status.staged import write_staged

__all__ = ["Asked", "Surroundings", "ask", "standing", "surroundings", "write_staged"]
