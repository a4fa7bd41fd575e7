"""Finds threads, tasks, generators and queues of a student's Python that do not do what they are there for.

For `slips.py`. Nothing is executed. Python 3.8, standard library only.
"""

import ast

from script_tree import (
    CALLBACKS,
    LOOPS,
    all_of,
    argument,
    called_name,
    calls_in,
    dotted,
    functions_in,
    gives_function,
    is_call_alone,
    lines_from,
    names_in,
    parents_of,
    slip,
    walk,
)

STARTED = {"Thread": "thread", "Process": "process"}
OF_STARTED = {"daemon", "name", "setDaemon", "setName", "join", "is_alive"}
"""What is asked of a thread, or set, without that it starts."""
SENDERS = ("publish", "put", "put_nowait")


def waits(tree):
    """All that this module finds."""
    finders = (
        unstarted_threads, run_here, forked_publishers, async_callbacks, unstarted_generators, lost_tasks,
        unused_calls, spent_generators, emptied_once, timed_twice, kept_errors, left_on_errors,
    )  # fmt: skip
    for find in finders:
        yield from find(tree)


def unstarted_threads(tree):
    """`worker = Thread(target=f)` where nothing starts it, nor hands it on."""
    parents = parents_of(tree)
    for call in all_of(tree, ast.Call):
        what, parent = STARTED.get(called_name(call)), parents.get(call)
        if not what or not argument(call, 1, "target"):
            continue
        target = (
            dotted(parent.targets[0]) if isinstance(parent, ast.Assign) and len(parent.targets) == 1 else ""
        )
        if isinstance(parent, ast.Expr):
            message = "nothing starts the %s that line %d makes" % (what, call.lineno)
            fix = "on line %d, write `.start()` behind the last bracket" % call.end_lineno
            yield slip(call.lineno, "stuck", message, fix, what)
        elif target and "..." not in target and used_for(target, tree) <= OF_STARTED:
            message = "nothing starts the %s `%s` that line %d makes" % (what, target, call.lineno)
            yield slip(
                call.lineno,
                "stuck",
                message,
                "below line %d, write `%s.start()`" % (call.end_lineno, target),
                target,
            )


def run_here(tree):
    """`Thread(target=work())`, and `worker.run()`, which run a function that never ends in the thread that calls it."""
    functions, parents, runs, early = functions_in(tree), parents_of(tree), {}, []
    for call in (n for n in all_of(tree, ast.Call) if called_name(n) in STARTED):
        target, parent = next(iter(argument(call, 1, "target")), None), parents.get(call)
        name, what = dotted(getattr(target, "func", target)), STARTED[called_name(call)]
        own = functions.get(name.rpartition(".")[2])
        if own is None or not any(isinstance(n, ast.While) for n in ast.walk(own)) or gives_function(own):
            continue
        if isinstance(target, ast.Call):
            early.append((call.lineno, name, what, target.args))
        elif isinstance(parent, ast.Assign):
            runs[dotted(parent.targets[0])] = what
    early.sort(key=lambda one: one[0])
    if early:
        line, name, what, values = early[0]
        message = "line %d runs `%s()` itself, and makes its %s only when that ends" % (line, name, what)
        fix = "on line %d, write `target=%s`, without the brackets" % (line, name)
        fix += " and with `args=(…,)` for what is in them" if values else ""
        yield slip(line, "stuck", message, fix + and_on([one[0] for one in early[1:]]), name)
    started = {dotted(n.func.value) for n in calls_in(tree, "start")} if runs else set()
    called = (
        [n for n in calls_in(tree, "run") if dotted(n.func.value) in runs.keys() - started] if runs else []
    )
    called.sort(key=place)
    if called:
        name, line = dotted(called[0].func.value), called[0].lineno
        message = "`%s.run()` on line %d starts no %s: the lines below wait until it ends" % (
            name,
            line,
            runs[name],
        )
        fix = "on line %d, write `%s.start()` in place of `%s.run()`" % (line, name, name)
        yield slip(line, "stuck", message, fix + and_on([n.lineno for n in called[1:]]), name)


def and_on(lines):
    """Return that the same is to be done on other lines."""
    return ", and the same on line %s" % " and ".join(map(str, lines)) if lines else ""


def used_for(name, tree):
    """Return which attributes of what a name holds are used; "" among them where all of it is passed on."""
    last, parents, used = name.rpartition(".")[2], parents_of(tree), set()
    for node in all_of(tree, ast.Name, ast.Attribute):
        own = getattr(node, "id", getattr(node, "attr", "")) == last
        if own and isinstance(node.ctx, ast.Load):
            parent = parents.get(node)
            used.add(parent.attr if isinstance(parent, ast.Attribute) else "")
    return used


def forked_publishers(tree):
    """A publisher that is handed to a `Process`, whose copy of it no subscriber can find."""
    made = {dotted(n.targets[0]): n for n in all_of(tree, ast.Assign) if called_name(n.value) == "Publisher"}
    if not calls_in(tree, "Process") and not any(called_name(n) == "Process" for n in walk(tree)):
        return
    functions = functions_in(tree)
    for call in all_of(tree, ast.Call):
        if called_name(call) != "Process":
            continue
        target = functions.get(dotted(next(iter(argument(call, 1, "target")), None)).rpartition(".")[2])
        if target is None or not calls_in(target, "publish") or calls_in(target, "init_node", "Publisher"):
            continue
        given = {dotted(n) for k in call.keywords for n in ast.walk(k.value)}
        used = {dotted(n.func.value) for n in calls_in(target, "publish")}
        names = sorted((given | used) & set(made))
        if names:
            message = (
                "line %d runs `%s` in a process of its own, and no subscriber finds the copy of `%s` there"
            )
            fix = "on line %d, write `threading.Thread(…)` in place of `%s(…)`, and import threading"
            yield slip(
                call.lineno, "stuck", message % (call.lineno, target.name, names[0]),
                fix % (call.lineno, dotted(call.func)), target.name,
            )  # fmt: skip


def async_callbacks(tree):
    """A callback that is an `async def`, or that has a `yield` in it: calling it runs none of its lines."""
    functions = {n.name: n for n in all_of(tree, ast.FunctionDef, ast.AsyncFunctionDef)}
    froms = [n for n in all_of(tree, ast.ImportFrom) if n.module != "rospy"]
    of_others = {a.asname or a.name for n in froms for a in n.names} | {"threading.Timer"}
    of_others |= {n.name for n in all_of(tree, ast.ClassDef)}
    for call in all_of(tree, ast.Call):
        name = called_name(call)
        if name not in CALLBACKS or dotted(call.func) in of_others:
            continue
        given = argument(call, *CALLBACKS[name])
        own = functions.get(dotted(given[0]).rpartition(".")[2]) if given else None
        if own is None or own.decorator_list:
            continue
        if isinstance(own, ast.AsyncFunctionDef):
            message = (
                "`%s` is an `async def`, and rospy calls it without `await`: none of its lines runs"
                % own.name
            )
            fix = "on line %d, write `def %s`, and no `await` below it" % (own.lineno, own.name)
            yield slip(own.lineno, "callback-called", message, fix, own.name)
        elif yields(own):
            line = min(n.lineno for n in yields(own))
            message = (
                "the `yield` on line %d makes `%s` a generator: when rospy calls it, none of its lines runs"
            )
            fix = "write line %d without `yield`" % line
            yield slip(own.lineno, "callback-called", message % (line, own.name), fix, own.name)


def yields(function):
    """Return the `yield`s of a function itself, and of none that it defines."""
    found, inside = [], list(function.body)
    while inside:
        node = inside.pop()
        if isinstance(node, (ast.Yield, ast.YieldFrom)):
            found.append(node)
        if not isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda, ast.ClassDef)):
            inside.extend(ast.iter_child_nodes(node))
    return found


def generators(tree):
    """Return the generators of a script by their names: those that nothing decorates and that have one definition."""
    functions = all_of(tree, ast.FunctionDef)
    names = [one.name for one in functions]
    return {f.name: f for f in functions if not f.decorator_list and names.count(f.name) == 1 and yields(f)}


def made_generators(tree):
    """Yield each name that is given a generator once, with the assignment and the generator's function."""
    own = generators(tree)
    targets = [(dotted(t), n) for n in all_of(tree, ast.Assign) for t in n.targets]
    for name, assigned in targets:
        function = own.get(called_name(assigned.value))
        owner = dotted(getattr(assigned.value, "func", None)).rpartition(".")[0]
        if (
            function
            and owner in ("", "self")
            and [n for n, _ in targets].count(name) == 1
            and "..." not in name
        ):
            yield name, assigned, function


def unstarted_generators(tree):
    """`out.send` of a generator that no `next(out)` has brought to its first `yield`."""
    for name, assigned, function in made_generators(tree):
        sends = [n for n in all_of(tree, ast.Attribute) if n.attr == "send" and dotted(n.value) == name]
        calls = [
            n for n in all_of(tree, ast.Call) if called_name(n) == "next" and name in map(dotted, n.args)
        ]
        begun = [n for n in calls_in(tree, "send") if n.args and getattr(n.args[0], "value", "") is None]
        if not sends or calls or begun or used_for(name, tree) - {"send", "close"}:
            continue
        message = "`%s` on line %d is at the beginning of `%s`, not at a `yield` that takes what it is sent"
        message %= (name, assigned.lineno, function.name)
        fix = "below line %d, write `next(%s)`: it runs to the first `yield`" % (assigned.lineno, name)
        handed = [
            n
            for n in sends
            if not isinstance(parents_of(tree).get(n), ast.Call) or called_name(parents_of(tree)[n]) != "send"
        ]
        yield slip(assigned.lineno, "callback-called" if handed else "stuck", message, fix, name)


def unused_calls(tree):
    """A call, alone on its line, of the script's own `async def` or generator, which runs none of its lines."""
    own, parents = generators(tree), parents_of(tree)
    tasks = {n.name: n for n in all_of(tree, ast.AsyncFunctionDef) if not n.decorator_list}
    plain = {n.name for n in all_of(tree, ast.FunctionDef)}
    for node in walk(tree):
        if not is_call_alone(node):
            continue
        owner, _, name = dotted(node.value.func).rpartition(".")
        if owner not in ("", "self"):
            continue
        around = function_of(node, parents)
        call = "%s(…)" % dotted(node.value.func) if node.value.args else "%s()" % dotted(node.value.func)
        if name in own:
            message = "line %d makes a generator of `%s` and goes through none of its values" % (
                node.lineno,
                call,
            )
            inside = around is not None and bool(yields(around))
            fix = "write `yield from %s`" % call if inside else "write `for one in %s:`" % call
            yield slip(node.lineno, "stuck", message, "on line %d, %s" % (node.lineno, fix), name)
        elif name in tasks and name not in plain:
            message = "`%s` is an `async def`, and a call alone runs none of its lines" % name
            inside = isinstance(around, ast.AsyncFunctionDef)
            fix = "write `await %s`" % call if inside else "write `asyncio.run(%s)`" % call
            yield slip(node.lineno, "stuck", message, "on line %d, %s" % (node.lineno, fix), name)


def lost_tasks(tree):
    """`create_task(…)` at the end of what `asyncio.run(…)` runs, which ends its tasks when it is over."""
    run = [n.args[0] for n in calls_in(tree, "run") if dotted(n.func) == "asyncio.run" and n.args]
    for name in map(called_name, run):
        for own in [n for n in all_of(tree, ast.AsyncFunctionDef) if n.name == name]:
            made = [n for n in ast.walk(own) if called_name(n) in ("create_task", "ensure_future")]
            last = max((n.lineno for n in made), default=0)
            later = [
                n for n in ast.walk(own) if isinstance(n, (ast.Await, ast.AsyncWith, ast.AsyncFor, *LOOPS))
            ]
            spins = calls_in(own, "spin")
            if made and not spins and not any(n.end_lineno >= min(m.lineno for m in made) for n in later):
                message = "`%s()` is over after line %d, and with it the task that line %d begins"
                call = "await %s" % dotted(made[-1].func)
                fix = "on line %d, write `await` before `%s(…)`" % (last, call[len("await ") :])
                yield slip(last, "loop-left", message % (name, own.end_lineno, last), fix)


def spent_generators(tree):
    """`next(x)` in a loop, of a generator that has only so many values."""
    for name, _, function in made_generators(tree):
        asked = [
            n for n in all_of(tree, ast.Call) if called_name(n) == "next" and name in map(dotted, n.args[:1])
        ]
        asked = [n for n in asked if len(n.args) == 1]
        loops = [n for n in ast.walk(function) if isinstance(n, LOOPS) and yields_in(n)]
        endless = [n for n in loops if isinstance(n, ast.While)]
        inner = [n for n in yields(function) if isinstance(n, ast.YieldFrom)]
        calls = {called_name(n.iter) for n in loops if isinstance(n, ast.For)}
        if (
            not asked
            or endless
            or inner
            or len(loops) != 1
            or calls - {"range", "enumerate"}
            or loops[0] not in function.body
        ):
            continue
        loop = loops[0]
        message = "`%s` on line %d has no more values after its loop on line %d" % (
            function.name,
            function.lineno,
            loop.lineno,
        )
        fix = "above line %d, write `while True:`, and begin %s with four more spaces"
        fix %= (loop.lineno, lines_from(loop.lineno, loop.end_lineno))
        for call in asked:
            yield slip(call.lineno, "runs-out", message, fix, name)


def yields_in(node):
    return any(isinstance(n, (ast.Yield, ast.YieldFrom)) for n in ast.walk(node))


def emptied_once(tree):
    """A loop that goes on while a queue has something in it, run once, before any message can have come."""
    parents = parents_of(tree)
    for call in all_of(tree, ast.Call):
        if called_name(call) != "Subscriber":
            continue
        given = argument(call, 2, "callback")
        put = (
            given[0].value
            if given and isinstance(given[0], ast.Attribute) and given[0].attr == "put"
            else None
        )
        name = dotted(put) if put is not None else ""
        for loop in all_of(tree, ast.While) if name else ():
            asks = [
                n
                for n in ast.walk(loop.test)
                if called_name(n) in ("empty", "qsize") and dotted(n.func.value) == name
            ]
            around = loop
            while around in parents and not isinstance(around, (ast.FunctionDef, ast.ClassDef)):
                around = parents[around]
                if isinstance(around, LOOPS):
                    asks = []
            if not asks or (isinstance(around, ast.FunctionDef) and around is not function_of(call, parents)):
                continue
            message = "the loop on line %d ends as soon as `%s` is empty, before the first message comes" % (
                loop.lineno,
                name,
            )
            fix = (
                "on line %d, write `while not rospy.is_shutdown():`, and `%s.get()` waits for each message"
                % (loop.lineno, name)
            )
            topics = argument(call, 0, "name")
            yield slip(
                loop.lineno, "not-printed", message, fix, getattr(topics[0], "value", "") if topics else ""
            )


def function_of(node, parents):
    """Return the innermost function that a node is in, or that it is; None outside of all."""
    while node is not None and not isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
        node = parents.get(node)
    return node


def timed_twice(tree):
    """Two timers that call the same function, which publishes."""
    functions, parents, first = functions_in(tree), parents_of(tree), {}
    for call in sorted((n for n in all_of(tree, ast.Call) if dotted(n.func) == "rospy.Timer"), key=place):
        given = dotted(next(iter(argument(call, 1, "callback")), None))
        own = functions.get(given.rpartition(".")[2])
        once = any(k.arg == "oneshot" for k in call.keywords) or len(call.args) > 2
        around = call
        while around in parents and not isinstance(around, (ast.FunctionDef, ast.If, ast.Try, *LOOPS)):
            around = parents[around]
        decided = isinstance(around, (ast.If, ast.Try, *LOOPS)) and "__name__" not in names_in(around)
        if own is None or once or decided or not calls_in(own, "publish") or calls_in(tree, "shutdown"):
            continue
        line = first.setdefault(given, call.lineno)
        if line != call.lineno:
            message = "the timers on lines %d and %d both call `%s`" % (line, call.lineno, given)
            yield slip(call.lineno, "publish-twice", message, "delete line %d" % call.lineno, given)


NAMED_FOR_VALUES = ("rospy.get_time", "rospy.get_rostime", "rospy.Time.now", "rospy.get_name", "time.time")


def kept_errors(tree):
    """`pool.submit(f)` whose result nothing asks for: an error in `f` is kept there, and nothing shows it."""
    functions, parents = functions_in(tree), parents_of(tree)
    for call in calls_in(tree, "submit"):
        own = functions.get(dotted(call.args[0]).rpartition(".")[2]) if call.args else None
        if own is None or not isinstance(parents.get(call), ast.Expr) or not calls_in(own, *SENDERS):
            continue
        if any(isinstance(n, ast.Try) for n in ast.walk(own)):
            continue
        inside = (n for n in ast.walk(own) if isinstance(n, ast.Attribute) and dotted(n) in NAMED_FOR_VALUES)
        named = next((n for n in inside if getattr(parents.get(n), "func", None) is not n), None)
        shows = "`submit` on line %d shows no error of `%s`" % (call.lineno, own.name)
        if named is not None:
            message = "line %d uses `%s` without calling it, and %s" % (named.lineno, dotted(named), shows)
            yield slip(
                named.lineno,
                "stuck",
                message,
                "on line %d, write `%s()`" % (named.lineno, dotted(named)),
                own.name,
            )
        else:
            fix = (
                "on line %d, write `.result()` behind the last bracket: it raises the error" % call.end_lineno
            )
            yield slip(call.lineno, "stuck", shows, fix, own.name)


def left_on_errors(tree):
    """A loop that waits for one message at a time, and that an exception of `wait_for_message(…)`, or an empty queue,
    makes it leave."""
    parents = parents_of(tree)
    for call in all_of(tree, ast.Call):
        given = argument(call, 2, "timeout") if called_name(call) == "wait_for_message" else []
        given = given or ([call] if called_name(call) in ("get", "get_nowait") else [])
        of_queue = given == [call]
        around, handlers = call, []
        while given and around in parents and not isinstance(around, (ast.FunctionDef, *LOOPS)):
            around = parents[around]
            handlers += around.handlers if isinstance(around, ast.Try) else []
        if not isinstance(around, ast.While) or (of_queue and not calls_in(around.test, "is_shutdown")):
            continue
        handlers = [h for h in handlers if not of_queue or dotted(h.type).rpartition(".")[2] == "Empty"]
        for one in handlers:
            left = next((n for n in one.body if isinstance(n, (ast.Break, ast.Return))), None)
            if left is not None:
                word = "break" if isinstance(left, ast.Break) else "return"
                message = (
                    "the `%s` on line %d leaves the loop as soon as line %d has waited too long for a message"
                )
                if of_queue:
                    message = "the `%s` on line %d leaves the loop as soon as the queue of line %d is empty"
                fix = "on line %d, write `continue` in place of `%s`" % (left.lineno, word)
                yield slip(left.lineno, "ends-node", message % (word, left.lineno, call.lineno), fix)


def place(node):
    return node.lineno, node.col_offset
