"""Leafing through records, one per page."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.text import Text

    from cgdb.cli.screen import Screen


def leaf(screen: Screen, count: int, page: Callable[[int], Sequence[Text]]) -> None:
    """Show page 0 of count on the whole screen; keys turn the pages. Returns when the person leaves."""
    from prompt_toolkit.application import Application
    from prompt_toolkit.formatted_text import ANSI
    from prompt_toolkit.key_binding import KeyBindings
    from prompt_toolkit.layout import HSplit, Layout, Window
    from prompt_toolkit.layout.controls import FormattedTextControl

    place = 0
    keys = KeyBindings()
    kept: dict[int, ANSI] = {}

    def turn(to: int) -> Callable[[Any], None]:
        def handle(event: Any) -> None:
            nonlocal place
            place = max(0, min(count - 1, {0: 0, 9: count - 1}.get(to, place + to)))
            control_window.vertical_scroll = 0

        return handle

    def leave(event: Any) -> None:
        event.app.exit()

    for names, to in (
        (("right", "n", " ", "pagedown", "j", "enter"), 1),
        (("left", "p", "b", "pageup", "k", "backspace"), -1),
        (("home", "g"), 0),
        (("end", "G"), 9),
    ):
        for name in names:
            keys.add(name)(turn(to))
    for name in ("q", "escape", "c-c", "c-d"):
        keys.add(name, eager=True)(leave)

    @keys.add("down")
    def _(event: Any) -> None:
        control_window.vertical_scroll += 1

    @keys.add("up")
    def _(event: Any) -> None:
        control_window.vertical_scroll = max(0, control_window.vertical_scroll - 1)

    def shown() -> ANSI:
        if place not in kept:
            kept[place] = ANSI(screen.ansi(page(place)))
        return kept[place]

    def foot() -> str:
        return f" record {place + 1} of {count}   → next   ← back   ↑↓ scroll   q leave "

    control_window = Window(FormattedTextControl(shown), wrap_lines=True, always_hide_cursor=True)
    foot_window = Window(FormattedTextControl(foot), height=1, style="reverse", always_hide_cursor=True)
    Application(
        layout=Layout(HSplit([control_window, foot_window])), key_bindings=keys, full_screen=True, erase_when_done=True
    ).run()
