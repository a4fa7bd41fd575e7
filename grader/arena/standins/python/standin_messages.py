"""Python classes for message and service definitions, made by ROS's genpy in memory when they are first asked for."""

import sys
from pathlib import Path
from types import ModuleType

import genmsg.msg_loader
import genmsg.msgs
import genmsg.srvs
import genpy.generator


def define(namespace):
    """Fill a package's module `msg` or `srv`: its names come from the `.msg` or `.srv` files beside the package's
    `package.xml`, and are made when they are looked up."""
    package, kind = namespace["__name__"].split(".")
    folder = Path(namespace["__file__"]).resolve().parents[3] / kind
    definitions = {path.stem: path for path in sorted(folder.glob("*." + kind))}

    def look_up(name):
        stem = _definition_of(name, definitions, kind)
        if stem is None:
            raise AttributeError(f"module {package}.{kind} has no attribute {name}")
        made = _make(package, kind, stem, definitions[stem].read_text(encoding="utf-8"))
        # As if genpy had written a file for it: `turtlesim.msg._Pose` is a module, too.
        setattr(sys.modules[namespace["__name__"]], "_" + stem, made)
        namespace.update({key: value for key, value in vars(made).items() if key.startswith(stem)})
        return namespace.get(name, made)

    namespace["__getattr__"] = look_up
    namespace["__all__"] = [stem + part for stem in definitions for part in _parts(kind)]


def _parts(kind):
    return ("", "Request", "Response") if kind == "srv" else ("",)


def _definition_of(name, definitions, kind):
    """Return the definition that a name of the module comes from: `Spawn` for `SpawnRequest` and for `_Spawn`."""
    candidates = [name[1:]] if name.startswith("_") else [name]
    candidates += [name[: -len(part)] for part in _parts(kind) if part and name.endswith(part)]
    return next((stem for stem in candidates if stem in definitions), None)


def _make(package, kind, stem, text):
    """Return the module that genpy's programs would have written into a file."""
    full_name = f"{package}/{stem}"
    context = genmsg.msg_loader.MsgContext.create_default()
    if kind == "srv":
        spec = genmsg.msg_loader.load_srv_from_string(context, text, full_name)
        lines = genpy.generator.srv_generator
    else:
        spec = genmsg.msg_loader.load_msg_from_string(context, text, full_name)
        lines = genpy.generator.msg_generator
    if "Header" in text:
        _register_header(context)
    module = ModuleType(f"{package}.{kind}._{stem}")
    code = compile("\n".join(lines(context, spec, {})), module.__name__, "exec")
    exec(code, vars(module))  # noqa: S102 - as genpy's own generate_dynamic, from our own definitions
    sys.modules[module.__name__] = module
    return module


def _register_header(context):
    """The one type of another package that these definitions use."""
    from std_msgs.msg import Header  # noqa: PLC0415 - only where it is used

    text = Header._full_text  # noqa: SLF001 - genpy's own name for it
    context.register(
        "std_msgs/Header", genmsg.msg_loader.load_msg_from_string(context, text, "std_msgs/Header")
    )
