"""The keys of the prompt: what Enter, Tab and their like do to what is being typed."""

from __future__ import annotations

from prompt_toolkit.buffer import CompletionState
from prompt_toolkit.completion import CompleteEvent, Completer, get_common_complete_suffix
from prompt_toolkit.filters import completion_is_selected
from prompt_toolkit.key_binding import KeyBindings, KeyPressEvent

from cgdb.cli import script


def keys(completer: Completer) -> KeyBindings:
    """The bindings. completer: whose choices Tab takes."""
    bound = KeyBindings()

    @bound.add("enter", filter=~completion_is_selected)
    def _(event: KeyPressEvent) -> None:
        """Run what is complete, else begin a new line."""
        buffer = event.current_buffer
        if script.complete(buffer.text):
            buffer.validate_and_handle()
        else:
            _new_line(event)

    @bound.add("enter", filter=completion_is_selected)
    def _(event: KeyPressEvent) -> None:
        """Take the choice that is marked."""
        event.current_buffer.complete_state = None

    @bound.add("escape", "enter")
    def _(event: KeyPressEvent) -> None:
        """A new line in any case."""
        _new_line(event)

    @bound.add("f4")
    def _(event: KeyPressEvent) -> None:
        """Edit in $EDITOR."""
        event.current_buffer.open_in_editor(validate_and_handle=False)

    @bound.add("tab")
    def _(event: KeyPressEvent) -> None:
        """Offer choices; take a single one, or what all begin with, at once; go to the next."""
        buffer = event.current_buffer
        if buffer.complete_state:
            buffer.complete_next()
            return
        # Worked out here and now: a completion that still runs for the letters before would drop this one.
        found = list(completer.get_completions(buffer.document, CompleteEvent(completion_requested=True)))
        if len(found) == 1:
            buffer.apply_completion(found[0])
            return
        if common := get_common_complete_suffix(buffer.document, found):
            buffer.insert_text(common)
            found = list(completer.get_completions(buffer.document, CompleteEvent(completion_requested=True)))
        if found:
            buffer.complete_state = CompletionState(buffer.document, found)
            buffer.on_completions_changed.fire()

    return bound


def _new_line(event: KeyPressEvent) -> None:
    """A line that begins below the first word of the one before."""
    buffer = event.current_buffer
    before = buffer.document.current_line_before_cursor
    buffer.insert_text("\n" + before[: len(before) - len(before.lstrip())])
