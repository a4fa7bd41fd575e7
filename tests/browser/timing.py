"""How long an action takes in a page: from the user's own event until what it changes is on the screen."""

from __future__ import annotations

from collections.abc import Callable

from playwright.sync_api import Page

# The second frame begins when the first one, with the change in it, has been laid out and handed over.
PAINTED = "(done) => requestAnimationFrame(() => requestAnimationFrame(() => done(performance.now())))"
USABLE = f"""
if (window === window.top) {{
  window.usableMs = new Promise((done) => addEventListener("DOMContentLoaded", () => ({PAINTED})(done)));
}}
"""
SHOWN = f"""
window.shownMs = new Promise((done) => addEventListener("%s", (event) => {{
  const look = () => (%s) ? ({PAINTED})((now) => done(now - event.timeStamp)) : setTimeout(look, 1);
  setTimeout(look);
}}, {{ capture: true, once: true }}));
"""
LEFT = """
addEventListener("%s", (event) => {
  sessionStorage.setItem("leftAt", performance.timeOrigin + event.timeStamp);
}, { capture: true, once: true });
"""
ARRIVED = (
    "window.usableMs.then((ms) => performance.timeOrigin + ms - Number(sessionStorage.getItem('leftAt')))"
)


class Timing:
    """Times what is done in one page, in milliseconds by the browser's own clock.

    What Playwright takes to find an element and to press it is not part of any figure.
    """

    def __init__(self, page: Page) -> None:
        self._page = page
        page.context.add_init_script(USABLE)

    def opening(self, address: str) -> float:
        """Return the time from the start of the navigation to `address` until the page is usable."""
        self._page.goto(address)
        return float(self._page.evaluate("window.usableMs"))

    def following(self, act: Callable[[], object], event: str = "click") -> float:
        """Return the time from the first `event` of `act` until the page that it leads to is usable."""
        self._page.evaluate(f"() => {{ {LEFT % event} }}")
        with self._page.expect_navigation():
            act()
        return float(self._page.evaluate(ARRIVED))

    def changing(self, act: Callable[[], object], event: str = "click", until: str = "true") -> float:
        """Return the time from the first `event` of `act` until its change is painted.

        Where the change comes later than the event's own handlers make it, `until` is the condition in JavaScript.
        """
        self._page.evaluate(f"() => {{ {SHOWN % (event, until)} }}")
        act()
        return float(self._page.evaluate("window.shownMs"))
