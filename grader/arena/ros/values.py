"""Values from student's programs: how much memory they take, and in a form that fits into the evidence."""

import itertools

TEXT_CHARS_MAX = 1 << 16
ITEM_BYTES = 64
DEPTH_MAX = 30


def weight(value, most):
    """About how many bytes of memory it takes; counting ends past `most`."""
    total, waiting = 0, [iter((value,))]
    while waiting and total <= most:
        for item in waiting.pop():
            total += ITEM_BYTES
            if isinstance(item, (str, bytes)):
                total += len(item)
            elif isinstance(item, dict):
                waiting += [iter(item), iter(item.values())]
            elif isinstance(item, (list, tuple)):
                waiting.append(iter(item))
            elif hasattr(item, "data"):  # xmlrpc.client.Binary
                total += len(item.data)
            if total > most:
                break
    return total


def depth(value, most):
    """How many maps and lists are one inside the other; counting ends past `most`."""
    level, inside = 0, [value]
    while level <= most:
        inside = list(itertools.chain.from_iterable(_items(item) for item in inside))
        if not inside:
            return level
        level += 1
    return level


def plain(value, most):
    """A copy that JSON can hold, or None if that is more than `most` bytes."""
    return _plain(value) if weight(value, most) <= most else None


def _plain(value):
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    return repr(value)


def _items(value):
    if isinstance(value, dict):
        return value.values()
    return value if isinstance(value, (list, tuple)) else ()


def cut(text, chars_max):
    """Shown in evidence: no longer than that, whatever it is."""
    text = str(text)
    return text if len(text) <= chars_max else text[: chars_max - 1] + "…"
