"""Words for attacks: lies beside `attacker.py`, and runs under ROS's Python (3.8)."""

import sys


def say(text):
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def tried(*actions):
    """Call each action, which must not succeed: what comes back is harm, unless it is None."""
    for action in actions:
        _try(action)


def _try(action):
    try:
        got = action()
    except BaseException as error:  # noqa: BLE001 - an attack goes on
        say(f"tried: refused: {type(error).__name__}: {error}"[:300])
    else:
        say("tried: nothing came of it" if got is None else f"HARM: {got!r}"[:2000])


def done(text=""):
    """The attack was made, and what counts is what becomes of it."""
    say("tried " + text)
