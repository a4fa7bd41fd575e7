"""Finds publishers of a student's Python that nothing uses, and messages that are made and go nowhere.

For `slips.py`. Nothing is executed. Python 3.8, standard library only.
"""

import ast

from script_names import USES_LIMIT, given_names, key_of
from script_tree import (
    LOOPS,
    all_of,
    argument,
    called_name,
    calls_in,
    dotted,
    is_call,
    names_in,
    parents_of,
    published_type,
    reads_names_in_texts,
    slip,
    text_of,
    walk,
)
from script_values import in_callback


def unused_publishers(tree):
    """Yield each `pub = Publisher(…)` whose `pub` nothing in the script uses, so that nothing is published by it."""
    # of an attribute, another object's name may stand for `self`, and a class's own is read by `self`
    read = {dotted(n).rpartition(".")[2] for n in walk(tree) if isinstance(getattr(n, "ctx", None), ast.Load)}
    if reads_names_in_texts(tree):
        return
    answers = calls_in(tree, "Subscriber", "Timer") and not all_of(tree, ast.While)
    where = in_callback(tree) if answers else " inside the loop" if all_of(tree, *LOOPS) else ""
    for node in all_of(tree, ast.Assign):
        name = dotted(node.targets[0])
        topics = argument(node.value, 0, "name") if is_call(node.value, "Publisher") else []
        if topics and "..." not in name and name.rpartition(".")[2] not in read:
            message = "nothing in the script calls `%s.publish(…)`" % name
            fix = "call `%s.publish(…)`%s" % (name, where)
            yield slip(node.lineno, "never-published", message, fix, text_of(topics[0]))
    yield from replaced_publishers(tree)


def replaced_publishers(tree):
    """Yield each `pub = Publisher(…)` whose name another publisher gets in the same block, before anything uses it."""
    for name, line, topic, below in replaced_names(tree):
        message = "line %d gives `%s` another publisher, so nothing is sent by this one" % (below, name)
        fix = "on line %d, give it another name than `%s`, and publish with each of the two" % (below, name)
        yield slip(line, "never-published", message, fix, topic)


def replaced_names(tree):
    """Yield the name of each such publisher, its line and topic, and the line of the other one."""
    blocks = [n.body for n in walk(tree) if isinstance(getattr(n, "body", None), list)]
    for body in blocks:
        made = {}
        for one in body:
            name = dotted(one.targets[0]) if isinstance(one, ast.Assign) else ""
            first = made.get(name)
            for used in [n for n in made if n in names_in(getattr(one, "value", one))]:
                del made[used]
            topics = argument(one.value, 0, "name") if name and is_call(one.value, "Publisher") else []
            if topics and first and first[1] != text_of(topics[0]):
                yield (name, *first, one.lineno)
            if topics:
                made[name] = one.lineno, text_of(topics[0])


def unsent_messages(tree):
    """Yield where a message is made and its fields are set, and nothing takes it."""
    froms = all_of(tree, ast.ImportFrom)
    of_messages = {a.asname or a.name for n in froms for a in n.names if is_of_messages(n.module)}
    if reads_names_in_texts(tree):
        return
    parents, made = parents_of(tree), []
    for node in all_of(tree, ast.Assign):
        kind = dotted(getattr(node.value, "func", None))
        is_message = kind in of_messages or ("*" in of_messages and kind[:1].isupper())
        if is_message or is_of_messages(kind.rpartition(".")[0]):
            made.append((node, kind))
    for node, kind in made[:USES_LIMIT]:
        around, name = scope_of(node, tree, parents), dotted(node.targets[0])
        if isinstance(around, ast.ClassDef):
            around, name = tree, "self." + name
        # a part of another message is sent with it
        if "." in name.replace("self.", "", 1):
            continue
        filled = stores_in(name, around if name.isidentifier() else tree)
        if filled and "..." not in name and len(node.targets) == 1:
            last = max(n.lineno for n in filled)
            message = "`%s` is filled in, and never used after that" % name
            fix = how_to_send(name, kind.rpartition(".")[2], last, around, tree)
            yield slip(last, "wrong-value", message, fix, "unsent")


def changed_copies(tree):
    """Yield where a map of parameters that `get_param` returned gets another value, and nothing sets the map."""
    read, sent = {}, set()
    for call in calls_in(tree, "set_param"):
        sent |= {dotted(n) for one in call.args[1:] for n in ast.walk(one)}
    for node in all_of(tree, ast.Assign):
        names = argument(node.value, 0, "param_name") if is_call(node.value, "get_param") else []
        if names and text_of(names[0]) and not text_of(names[0]).startswith("~"):
            read[dotted(node.targets[0])] = text_of(names[0])
    for node in all_of(tree, ast.Assign) if read else ():
        keys, target = [], node.targets[0]
        while isinstance(target, ast.Subscript):
            keys, target = [text_of(key_of(target)), *keys], target.value
        name = dotted(target)
        if keys and all(keys) and name in read and name not in sent:
            path = "/".join([read[name].rstrip("/"), *keys])
            value = name + "".join("['%s']" % key for key in keys)
            fix = "below line %d, write `rospy.set_param('%s', %s)`" % (node.lineno, path, value)
            yield slip(node.lineno, "changes-copy", path, fix, name)


def read_to_set(tree):
    """Yield where `get_param` gets a value besides the name, as `set_param` does: what is meant may be to set it."""
    for call in calls_in(tree, "get_param"):
        names, values = argument(call, 0, "param_name"), argument(call, 1, "default")
        if names and values and text_of(names[0]) and isinstance(values[0], ast.Constant):
            name, value = text_of(names[0]), values[0].value
            alone = any(node.value is call for node in all_of(tree, ast.Expr))
            where = "on line %d, write" if alone else "above line %d, write"
            fix = (where + " `rospy.set_param(%r, %r)`") % (call.lineno, name, value)
            yield slip(call.lineno, "read-to-set", name, fix, str(value))


def is_of_messages(module):
    return ".%s" % (module or "").rpartition(".")[2] in (".msg", ".srv")


def lost_objects(tree):
    """Yield where a name is used that is called like a class of messages or services, and gets no object of it."""
    froms = [n for n in all_of(tree, ast.ImportFrom) if is_of_messages(n.module)]
    kinds = {a.name.lower(): (a.name, n.module.endswith(".srv")) for n in froms for a in n.names}
    names, waits = all_of(tree, ast.Name), calls_in(tree, "wait_for_service")
    own = given_names(tree, names) if kinds else set()
    topic = next((text_of(n.args[0]) for n in waits if n.args), "") or "…"
    for node in (n for n in names if n.id in kinds and n.id not in own):
        (kind, of_service), around = kinds[node.id], parents_of(tree).get(node)
        is_set = isinstance(around, ast.Attribute) and isinstance(around.ctx, ast.Store)
        if is_set or (of_service and getattr(around, "func", None) is node):
            made = "%s()" % kind if is_set else "rospy.ServiceProxy('%s', %s)" % (topic, kind)
            fix = "above line %d, write `%s = %s`" % (node.lineno, node.id, made)
            yield slip(
                node.lineno, "undefined", "nothing in the file gives `%s` a value" % node.id, fix, node.id
            )
            return  # the first is where the script ends


def scope_of(node, tree, parents):
    """Return the function or class that a statement is in, or the module, where the names that it gives are known."""
    shared = {name for n in all_of(tree, ast.Global, ast.Nonlocal) for name in n.names}
    while node in parents and not isinstance(node, (ast.FunctionDef, ast.ClassDef)):
        if isinstance(node, ast.Assign) and shared.intersection(map(dotted, node.targets)):
            return tree
        node = parents[node]
    return node


def stores_in(name, scope):
    """Return where fields of a variable are set; none where its value is read as well."""
    inside = list(getattr(scope, "all_nodes", None) or ast.walk(scope))
    filled = [n for n in inside if isinstance(n, ast.Attribute) and isinstance(n.ctx, ast.Store)]
    filled = [n for n in filled if dotted(n).startswith(name + ".")]
    owners = {id(inner) for n in filled for inner in ast.walk(n.value)}
    bare = name.rpartition(".")[2]
    for n in inside:
        is_read = isinstance(getattr(n, "ctx", None), ast.Load) and id(n) not in owners
        # of an attribute, another object's name may stand for `self`
        if is_read and (dotted(n) == name or (bare != name and getattr(n, "attr", "") == bare)):
            return []
    return filled


FINISHING = ("set_succeeded", "set_aborted", "set_preempted", "set_rejected")


SENDING = ("publish", "publish_feedback", "sendTransform", *FINISHING)


def how_to_send(name, kind, last, scope, tree):
    """Return what to write for a message that is filled in, up to line `last`, to be sent."""
    servers = [n for n in all_of(tree, ast.Assign) if called_name(n.value) == "SimpleActionServer"]
    server = dotted(servers[0].targets[0]) if servers else "server"
    for n in ast.walk(scope):
        for given in n.args if is_call(n, *SENDING) else [n.value] if isinstance(n, ast.Return) else ():
            made = dotted(getattr(given, "func", given)).rpartition(".")[2]
            if made == kind and not getattr(given, "args", ()) and not getattr(given, "keywords", ()):
                empty = kind + ("()" if isinstance(given, ast.Call) else "")
                return "on line %d, write `%s` instead of `%s`" % (given.lineno, name, empty)
    if kind.endswith("Feedback"):
        return "below line %d, write `%s.publish_feedback(%s)`" % (last, server, name)
    if kind.endswith("Response"):
        return "write `return %s` at the end of the callback" % name
    made = [n for n in ast.walk(scope) if isinstance(n, ast.Assign) and isinstance(n.value, ast.Call)]
    sent = {dotted(arg) for n in ast.walk(scope) if is_call(n, "publish") for arg in n.args[:1]}
    taking = [n for n in made if dotted(n.targets[0]) in sent]
    if kind == "Header" and taking:
        last = max(last, taking[0].lineno)
        return "below line %d, write `%s.header = %s`" % (last, dotted(taking[0].targets[0]), name)
    publishers = [n for n in all_of(tree, ast.Assign) if is_call(n.value, "Publisher")]
    publishers = [n for n in publishers if published_type(n.value) == kind]
    if len(publishers) == 1:
        return "below line %d, write `%s.publish(%s)`" % (last, dotted(publishers[0].targets[0]), name)
    return "give `%s` to the call that should send it" % name
