"""A CGQL condition on its own: which objects of a scene fit it. For searches that are filtered."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from cgdb.errors import CgdbError
from cgdb.grammar import ast
from cgdb.grammar.parser import parse_condition
from cgdb.index.positions import Positions
from cgdb.query.binder import bind
from cgdb.query.executor import Executor, Profile
from cgdb.query.limits import Budget
from cgdb.query.planner import plan
from cgdb.query.run import check_ids
from cgdb.view import SceneView

OBJECT = "o"
"""What the object is called in the condition."""


def fitting(view: SceneView, condition: str, parameters: Mapping[str, Any], budget: Budget) -> Positions:
    """The positions of the objects that fit, ascending."""
    try:
        where = parse_condition(condition)
        query = ast.Query(
            patterns=(ast.Pattern(nodes=(ast.NodePattern(variable=OBJECT),)),),
            where=where,
            returns=(ast.ReturnItem(expression=ast.Variable(name=OBJECT)),),
        )
        bound = bind(query, view.catalog, parameters)
        check_ids(bound, [view])
        rows = Executor(view, bound, budget, Profile()).rows(plan(bound, view.catalog))
    except CgdbError as error:
        raise error.located(condition) from error.__cause__
    return np.sort(rows.nodes[OBJECT][rows.truth.fits])
