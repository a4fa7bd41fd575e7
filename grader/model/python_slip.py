"""What is remarkable in a student's Python, line by line: slips, and what its lines say that checks compare."""

from __future__ import annotations

import re
from typing import Literal

from grader.model.record import Record
from grader.model.verdict import Placed

SlipKind = Literal[
    "not-called", "input", "no-clock", "misspelt", "rate-parameter", "rate-number", "rate-random", "reset-value",
    "reset-limit", "set-in-loop", "reset-early", "never-called", "main-guard", "never-reached", "spin-in-loop",
    "never-begun", "loop-left", "ends-node", "sleep-outside", "sleep-twice", "callback-called", "callback-missing",
    "callback-values", "callback-waits", "defined-twice", "subscribed-again", "clock-value", "queue-size", "deaf",
    "deaf-loop", "node-name", "no-init", "commented-out", "publisher", "publisher-type", "subscriber",
    "subscriber-type", "outside-method", "object", "undefined", "no-effect", "compared", "publishes", "prints",
    "argument-text", "unused-import", "lacking-import", "unregistered", "not-started", "start-value", "hides-class",
    "float-index", "ranges-read", "added-first", "publish-twice", "wrong-value", "sets-parameter", "not-printed",
    "printed-in-part", "published-in-part", "never-published", "takes-number", "typed-text", "goes-on",
    "no-argument", "read-late", "debugger", "drops-result", "returns-list", "fills", "catches", "no-result",
    "stuck", "runs-out", "base-unmade", "rate-as-time", "frames", "changes-copy", "step-number", "keeps-rate",
    "way-number", "read-to-set", "swallows", "counter-type",
]  # fmt: skip


class PythonSlip(Placed, Record):
    """What is remarkable in a Python file. For a file that does not compile, only names, types and rates are known; for
    one of C++, only `callback-waits`, `wrong-value`, `no-argument`, `input` and `deaf` (`name`: how long it sleeps at a
    time).

    `fix` says what to do where that is always the same. Slips, of which most show only when the node runs; `message`
    says what is wrong on that line, and `name` is the function or variable that both are about:

    - `not-called`: `rate.sleep` or `rospy.is_shutdown` without brackets.
    - `misspelt`: a name that the file does not define, next to one that it does; or an exception that rospy does not
      have, in an `except`.
    - `undefined`: why a name has no value where it is read.
    - `object`: why an object of a class lacks an attribute where it is read, or that the class is used in its place.
    - `outside-method`: a call in a class, but outside its methods, that uses an unknown name.
    - `defined-twice`: a callback that a second function of its name hides or that another one is
      given for, or an imported name that a class hides.
    - `float-index`: an index is worked out with `/`, which makes a float.
    - `hides-class`: a message is given the name of its class: `String = String()`.
    - `no-effect`, `compared`: a statement such as `++i`, or `i == 0` or `i % 128`, which were to reset it; or a loop
      that publishes what only a line above it made, `name`.
    - `stuck`: a line that waits for what never comes, or where a thread, a process or a task is made whose work never
      gets anywhere.
    - `runs-out`: `next(…)` of a generator that has only so many values.
    - `base-unmade`: an `__init__` that does not call its base class's; `name` is the class, and after it, the
      attributes that lack a value then.
    - `commented-out`: a ROS call in a comment; `name` is `sleep`, or `pub = Publisher`.
    - `input`: the node asks for input, and nodes get none; `name` is `once` where no loop does it again, and `paused`
      in a loop that sleeps.
    - `typed-text`: what is typed is kept as a text, in `name`: a slip only if a number is needed.
    - `debugger`: a call of Python's debugger, `name`.
    - `no-init`: a script with topics, or that does more than define names, never calls `init_node`.
    - `never-called`: a function that makes a node, publishes or waits, and that nothing calls.
    - `main-guard`: `__name__` is compared with another word than `__main__`.
    - `never-reached`: an endless loop before the first `init_node(…)` or `publish(…)`.
    - `read-late`: the first of the lines that such a loop, or `spin()`, holds up until the node ends, where one of them
      reads a parameter; `name` is the last.
    - `spin-in-loop`: a loop that publishes and waits in `spin()`.
    - `never-begun`: a loop whose condition, `name`, does not hold when the script reaches it: a `not` is missing, or a
      variable begins with the other value.
    - `loop-left`: a loop that ends in its first turn, or after a number of them, or a callback that ends the node, or
      the only `publish(…)`, above a loop that waits or in none (`name`: `once`), or several of them in none.
    - `ends-node`: a callback that ends the node, at least sometimes, or what leaves its loop upon an exception; a slip
      only if the node ended by itself.
    - `sleep-outside`, `sleep-twice`: a loop whose `sleep()` is outside it, or whose Rate nothing sleeps by, or that
      waits twice in each turn.
    - `publish-twice`: a loop that publishes on one topic more than once in each turn.
    - `deaf`, `deaf-loop`: why the node goes on after Ctrl-C; a loop that does not ask whether the node should end.
    - `callback-called`, `callback-values`, `callback-missing`: a callback that is called where it should only be named,
      that takes another number of values than ROS passes, or that does not exist.
    - `callback-waits`: a topic's or service's callback that sleeps, or never ends, or makes its publisher itself.
    - `not-printed`: why a topic's callback prints nothing of any message; `name` is the topic as it is written there.
    - `printed-in-part`: why it prints some messages only, or something else than their values; `name` as above.
    - `subscribed-again`: a `Subscriber(…)` that a loop makes in each turn.
    - `unregistered`: a `Publisher` or `Subscriber` that is taken off its topic.
    - `not-started`: an action server that waits for a `start()` that no line calls.
    - `queue-size`: a queue size that is a text, with which rospy sends nothing.
    - `set-in-loop`, `reset-early`: a counter that is set in each turn of its loop, or goes back before one is added.
    - `counter-type`: a counter that is a text, or numpy's `int8` (`name`: `text`, `int8`).
    - `no-clock`: the file publishes and counts, and nothing that it sends contains the time, except at most the value
      from which it counts on; a slip only if its messages have to contain the time.
    - `clock-value`: the values of the topic `message` are read from a clock, or made up at random (`name`: `random`),
      and nothing is counted.
    - `never-published`: a publisher of the topic `name` that nothing in the script uses.
    - `published-in-part`: a loop that publishes on the topic `name` only in some of its turns, though it counts in each
      or counts nothing.
    - `takes-number`: a loop that computes with what a topic's callback keeps of its message, or publishes it as a
      number: a slip only if that message has to be a text.
    - `goes-on`: an `if`, or a loop's first turn, that ends an action's goal by the call `name`, and goes on.
    - `wrong-value`: a value that is none: a comparison with NaN, the sine of an angle in degrees, a service's
      answer that is made and not returned, or of which no field is set, a message that is filled in and not
      sent, a speed that a Twist keeps from the turn before, nanoseconds in place of seconds, a condition that
      all numbers fulfil, or none, or what each turn of a loop adds or sets again (`name`: `nan`, `degrees`,
      `return`, `empty`, `unsent`, `kept`, `nanoseconds`, `bounds`, `added`); a grid's index that steps by its
      height, a cell that `int(…)` works out of a number below 0, a quaternion of a whole angle, a float for the
      seconds of a time, the mean of a scan's ranges, a distance without its square root, a parameter that is
      read where it is not set, or before the node has its name (`early`), what nothing sets back, a cell that
      is compared with a grid's side as if it had one more, `atan2(x, y)`, two values of a call in each other's
      place, degrees beside radians, and a distance that is to be exactly 0 (`step`, `cut`, `half`, `secs`,
      `mean`, `rootless`, `unset`, `stuck`, `edge`, `swapped`, `mixed`, `exact`), a cell that is a product
      (`times`), letters of a key (`letters`), a timer's period of 0 (`zero`), a file that each call empties
      (`emptied`), or of a scan an inf that is made 0, the first one alone, an index that is an angle, a
      condition that drives where a wall is near, and ranges that are named after the other side (`inf`,
      `first`, `angle`, `turned`, `side`), metres that are centimetres (`metres`), a parent's frame that is
      given for the child's (`frames`), or a loop that always returns in its first turn (`turn`).

    No slips, but what a line says, for checks that compare it with what the lab asks; `message` is a name, a number or
    a text:

    - `node-name`, `publisher`, `subscriber`: where the script names its node, or a topic. `name` is the variable that
      gets the publisher, or `anonymous`; a node's name that stands in a variable has a `fix`, that line with `{}` in
      its place.
    - `publisher-type`, `subscriber-type`: the message type on that line.
    - `publishes`, `prints`: a text that is published or printed by the call `name` (`loginfo`), with `{}` for a value
      in it and `{data}` for that of a message. `fix` says where to move what an `if` or a `spin()` holds up.
    - `rate-number`, `rate-parameter`, `rate-random`: a loop or a timer whose rate is a number, in Hz, a parameter, or
      drawn at random by the call that `message` names.
    - `rate-as-time`: a time that is given a rate, or the other way round, by its name: a slip only where what it times
      comes far too seldom.
    - `frames`: two texts that are given next to each other, `message` and `name`, in a script that sends transforms
      (`fix`: on which lines, if on two).
    - `start-value`, `added-first`: where a counter, `name`, gets its first number, `message`, and where a loop adds one
      to it before it publishes (`fix`: which lines to move).
    - `way-number`: the only line that gives a variable `name` its number, `message`, which is a `distance` or a `time`
      by its name (`fix`).
    - `keeps-rate`: where a rate or a timer, `name`, is made once with what another function changes.
    - `step-number`: where a number, `message`, that is not 1 is added to the variable `name`, or by `name(…)` each time
      (`itertools.count`, `range`): then `fix` says what to write.
    - `reset-value`, `reset-limit`: where a counter goes back, to the number `message`, or when it reaches it (`name`:
      `range`, where it is that of a loop).
    - `sets-parameter`: where it sets a parameter.
    - `changes-copy`: where a map that was read from the parameter server, `name`, gets another value for the parameter
      `message`, and nothing sets that map there.
    - `read-to-set`: where `get_param(…)` gets a value, `name`, besides the name of a parameter, `message`, as
      `set_param(…)` does (`fix`).
    - `ranges-read`: which ranges of a scan it reads there (`90`, `-30:`, `n//2-9:` with `n` for their count); only
      where it reads no others.
    - `argument-text`: where an argument of the command line is kept as a text; `fix` is the line with a number in its
      place.
    - `no-argument`: where a program of C++ reads an argument, the `name`-th, whether there is one or not.
    - `drops-result`: where the function `name` is called, and what it returns on line `fix` is not kept; `{}` for a
      value.
    - `returns-list`: where a service's callback returns a list or a tuple (`name`), and the names in it.
    - `fills`: which fields a message of the class `name` gets that is made there, if all of this class can be told.
    - `catches`: which errors the `except`s of a `try` catch, where its last one stands; `name` has the first and the
      last line of the `try`'s block, `fix` the name that the `except` gives the error.
    - `no-result`: where an action's goal is ended by the call `name` without a result.
    - `swallows`: an `except` of every error that does nothing, or prints what is always the same: a slip only if the
      script does not do what it should; `name` is `run` where it is around what the node does as long as it runs.
    - `unused-import`, `lacking-import`: an import of the module `message` whose names nothing in the script uses, or
      that Python did not find where the files were read (`fix`: the name of a module in it, as `lab_msgs.msg`).
    """

    file: str
    line: int
    kind: SlipKind
    message: str
    fix: str = ""
    name: str = ""

    @property
    def is_endless(self) -> bool:
        """Whether a callback never ends, or is never called, or what it needs is made again and again: not a sleep."""
        told = re.search(
            r"never (?:ends|calls)|is ever called|calls spinOnce|subscribes again|makes another publisher",
            self.message,
        )
        return self.is_lock or (self.kind == "callback-waits" and bool(told))

    @property
    def is_lock(self) -> bool:
        """Whether a function waits for a lock that is held already."""
        return self.kind == "stuck" and self.name == "lock"
