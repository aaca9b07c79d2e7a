"""``cgdb``: the commands, their help, and the exit codes.

Exit codes: 0 done; 1 something was found wrong (check); 2 the command line; 3 the query's text or names; 4 the query
could not be carried out, or outgrew a limit; 5 a map or scene is wrong, or cannot be exported; 6 the store; 7 another
process is writing; 8 damaged data; 9 a missing package or model; 70 a bug in cgdb; 130 interrupted; 141 nobody reads
what is printed.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
from collections.abc import Container, Sequence
from importlib import import_module

import cgdb
from cgdb.cli import asking_options, enriching_options, evaluate_options, making_options, store_options
from cgdb.cli.command_line import Parser
from cgdb.errors import CgdbError, UsageError

EXAMPLES = """\
examples:
  cgdb demo
  cgdb import scene_graph.json --into home.cgdb
  cgdb query home.cgdb 'MATCH (o ~ "something to drink") WHERE NOT o ~ "soda" RETURN o LIMIT 3'
  cgdb search home.cgdb "red shoes" --where 'volume(o) < 0.1'
  cgdb export home.cgdb kitchen --format planner

exit codes: 0 done, 1 check found something, 2 command line, 3 query text or names, 4 query failed or outgrew a limit,
5 map or scene, 6 store, 7 store busy, 8 damaged data, 9 missing package or model, 70 a bug, 130 interrupted
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; the exit code. stdout is data, stderr is talk."""
    if hasattr(signal, "SIGPIPE"):
        # A model server that hangs up must not end the process, as the signal would.
        signal.signal(signal.SIGPIPE, signal.SIG_IGN)
    try:
        options = _options(sys.argv[1:] if arguments is None else arguments)
        command = getattr(import_module(options.module), options.function)
        code = int(command(options) or 0)
        sys.stdout.flush()
        return code
    except CgdbError as error:
        sys.stdout.flush()
        _say(error.render())
        return error.exit_code
    except KeyboardInterrupt:
        _say("interrupted; what was finished is kept, and nothing is half written")
        return 130
    except BrokenPipeError:
        # `cgdb query ... | head` ends quietly, as other tools do; what Python has yet to write goes nowhere.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 128 + 13
    except Exception as error:
        if os.environ.get("CGDB_DEBUG"):
            raise
        _say(f"internal error: {type(error).__name__}: {error}\nhint: this is a bug in cgdb; CGDB_DEBUG=1 shows where")
        return 70


def _options(arguments: Sequence[str]) -> argparse.Namespace:
    parser = _parser()
    if not arguments:
        parser.print_help(sys.stderr)
        raise SystemExit(UsageError.exit_code)
    options: argparse.Namespace
    options, left = parser.parse_known_args(_with_shell(arguments, parser.commands))
    # Before Python 3.13 argparse does not see an optional word that follows a flag: plot STORE -o FILE CGQL.
    last = options.last
    if left and last is not None and getattr(options, last) is None and not left[0].startswith("-"):
        setattr(options, last, left.pop(0))
    if left:
        options.parser.refuse(left)
    return options


def _with_shell(arguments: Sequence[str], commands: Container[str]) -> list[str]:
    """`cgdb STORE` is `cgdb shell STORE`, where STORE is a folder that is called as no command is."""
    given = list(arguments)
    if not given or given[0].startswith("-") or given[0] in commands:
        return given
    # What looks like a path is one, also where there is nothing yet: the shell then says that there is no store.
    if os.path.isdir(given[0]) or given[0].endswith(".cgdb") or os.sep in given[0]:  # noqa: PTH112
        return ["shell", *given]
    return given


def _say(text: str) -> None:
    from cgdb.cli.render import clean_lines  # which the help can do without

    # A terminal obeys control characters; names in an error may come from a stranger's map.
    shown = clean_lines(text)
    sys.stderr.write(
        shown.encode(sys.stderr.encoding or "utf-8", "replace").decode(sys.stderr.encoding or "utf-8") + "\n"
    )


def _parser() -> Parser:
    parser = Parser(
        prog="cgdb",
        description="An embedded store for the 3D scene graphs that robots make: import a map, ask it, get it out.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"cgdb {cgdb.__version__}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for options in (making_options, asking_options, enriching_options, evaluate_options, store_options):
        options.add(commands)
    parser.commands = commands.choices
    return parser


if __name__ == "__main__":
    sys.exit(main())
