"""What of a package is not committed or not pushed: asked of git without the network, and told as advice."""

from grader.standing.around import Surroundings, surroundings
from grader.standing.ask import Asked, ask
from grader.standing.say import standing
from grader.standing.staged import write_staged

__all__ = ["Asked", "Surroundings", "ask", "standing", "surroundings", "write_staged"]
