"""The flow of a question in plain words: understand, translate to CGQL, run, re-rank, answer.

A language model translates and re-ranks where one is given; the built-in translator where none is, or where it fails,
and the answer says so. Whatever a model writes is parsed, bound and run as any statement: it can only read.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cgdb.asking.answer import Answer, first_node
from cgdb.asking.draft import Draft
from cgdb.asking.explained import Explained, explained
from cgdb.asking.intake import LONGEST_QUESTION, follow_up, scenes_named
from cgdb.asking.intake import checked as checked_question
from cgdb.asking.loosened import is_there, loosened, widened
from cgdb.asking.narrowed import narrowed
from cgdb.asking.reordered import failing, has_an_order, reordered, reranker_of
from cgdb.asking.shortlist import shortlist
from cgdb.asking.statements import among_previous, best_of, by_score, like, of_objects, returns_total, uncut
from cgdb.asking.survey import list_values, names, places, surveyed
from cgdb.asking.wording import facts
from cgdb.errors import (
    BindError,
    CgdbError,
    ExecuteError,
    LimitError,
    MissingExtraError,
    ParseError,
    QueryCancelled,
    StoreError,
    UsageError,
    one_of,
)
from cgdb.grammar import ast
from cgdb.grammar.printer import to_text
from cgdb.index.catalog import Catalog, merge
from cgdb.meaning.embed import Encoder
from cgdb.meaning.meanings import Vector
from cgdb.model.llm import Meter, Model, ModelError, Unreachable
from cgdb.model.model_translate import translated
from cgdb.model.pictures import checked, data_url, tower
from cgdb.model.prompts import describing, with_picture
from cgdb.model.rerank import ModelReranker, Reranker
from cgdb.model.translation_prompt import Surroundings
from cgdb.model.turned import turned
from cgdb.query.limits import Limits
from cgdb.result import Result, Row

if TYPE_CHECKING:
    from cgdb.database import Database
    from cgdb.english.intent import Setting
    from cgdb.english.translate import Translation
    from cgdb.scene import FeatureSpace

MOST_ROWS = 50
"""Rows of an answer where the question asks for no number."""
MOST_RELEVANT = 15
"""Ids of an answer that have to do with the question, where no model says which."""
NEAREST = 5
"""Things that are shown where nothing fits."""
SECONDS = 30.0

EncoderOf = Callable[["FeatureSpace"], "Encoder | CgdbError | None"]

_LIKE_PICTURE = re.compile(r"\b(like|similar|same|looks?|this|that|shown?|pictured?)\b", re.I)


def ask(
    db: Database,
    question: str,
    *,
    model: Model | None = None,
    previous: Answer | None = None,
    image: str | Path | None = None,
    scenes: Sequence[str] = (),
    as_of: int | str | None = None,
    rerank: bool | str | Reranker = True,
    limits: Limits | None = None,
    encoder_of: EncoderOf = lambda space: None,
) -> Answer:
    """The answer to a question. model None: the built-in translator. previous: the answer that it follows up.

    rerank: who reads the best rows once more: True for the model, where there is one; a re-ranker or its name; False.
    UsageError for a question that says nothing; a model that fails is no error but a warning.
    """
    return _Asking(db, question, model, previous, image, scenes, as_of, rerank, limits, encoder_of).answer()


class _Asking:
    def __init__(
        self,
        db: Database,
        question: str,
        model: Model | None,
        previous: Answer | None,
        image: str | Path | None,
        scenes: Sequence[str],
        as_of: int | str | None,
        rerank: bool | str | Reranker,
        limits: Limits | None,
        encoder_of: EncoderOf,
    ) -> None:
        self.warnings: list[str] = []
        self.reranker = reranker_of(rerank, model)
        self.given, cut = checked_question(question, has_picture=image is not None)
        if cut:
            self.warnings.append(cut)
        self.question = self.given
        self.db, self.model, self.previous = db, model, previous
        self.as_of, self.limits = as_of, limits or Limits(seconds=SECONDS)
        self.image = None if image is None else Path(image)
        there = tuple(info.name for info in db.scenes(as_of))
        named = tuple(scenes)
        if not named and len(there) > 1:
            named, self.question = scenes_named(there, self.question)
        self.scenes, self.asked = named, self.question
        if named and not scenes:
            self.warnings.append(f"asked of scene {one_of(named)} only, which the question names")
        names = self.scenes or there
        self.names = names
        self.views = [db.view(name, as_of) for name in names]
        self.catalog: Catalog = merge(view.catalog for view in self.views)
        self.meter = Meter(0.0) if model is None else model.meter()
        self.silent = False
        self.parameters: dict[str, Any] = {}
        if previous is not None and previous.ids:
            self.parameters["previous"] = list(previous.ids)
        self.encoder_of = encoder_of

    def answer(self) -> Answer:
        if self.image is not None:
            self._look(self.image)
        draft = self._with_model() or self._built_in()
        draft = self._shown_nearest(draft)
        if (answer := self._reranked(draft)) is not None:
            return answer
        draft = draft.cut()
        return self._answer(self._explained(draft))

    # -- the question -------------------------------------------------------------------------------------------

    def _look(self, image: Path) -> None:
        """Have the picture described by the model, and embedded where a feature space has an image tower."""
        checked(image)
        for space in (space for view in self.views for space in view.info.spaces):
            encoder = tower(self.encoder_of(space))
            if encoder is not None:
                self.parameters["picture"] = Vector(values=encoder.pictures([image])[0], space=space.name)
                break
        if self.model is not None:
            try:
                reply = self.model.chat(describing(self.question, data_url(image)), self.meter, max_tokens=300)
                self.asked = with_picture(self.question, reply.said)
            except ModelError as error:
                self.warnings.append(f"the picture was not described: {_line(error)}")
        if self.asked == self.question and "picture" not in self.parameters:
            if not self.question:
                raise UsageError(
                    "nothing here can look at a picture",
                    hint="a vision model (CGDB_LLM_MODEL), or a map with CLIP features and open_clip installed",
                )
            self.warnings.append("the picture was left out: there is neither a vision model nor a CLIP image tower")

    # -- translation --------------------------------------------------------------------------------------------

    def _with_model(self) -> Draft | None:
        """The model's statement, run; None where there is no model or it fails, which is said."""
        if self.model is None:
            return None
        try:
            draft, how = translated(self.model, self.asked, self._surroundings(), self.meter, self._of_model)
        except QueryCancelled:
            raise
        except (ModelError, MissingExtraError) as error:
            self.warnings.append(f"answered without the model: {_line(error)}")
            # A server that does not answer is not asked again for the order of the rows.
            self.silent = (
                not isinstance(error, ModelError) or isinstance(error, Unreachable) or error.status is not None
            )
        except (ParseError, BindError, ExecuteError) as error:
            self.warnings.append(f"answered without the model, which wrote no statement that holds: {_line(error)}")
        else:
            return replace(self._other_way(draft), how=how)
        return None

    def _surroundings(self) -> Surroundings:
        given = {}
        if "previous" in self.parameters:
            given["previous"] = (
                f"ids of the {len(self.parameters['previous'])} objects found before, for o.id IN $previous"
            )
        if "picture" in self.parameters:
            given["picture"] = "the picture, for o ~ $picture: things that look like it"
        tags: list[str] = []
        if self.as_of is None:  # a search is of now
            hits = self.db.search(self.asked[:500], k=60, scenes=[view.info.name for view in self.views])
            tags = [tag for node in hits.nodes if (tag := node.tag or node.caption)]
        return Surroundings(
            catalog=self.catalog,
            places=places(self.views),
            tags=tags,
            scenes=[view.info.name for view in self.views],
            values=list_values(self.views, self.catalog),
            parameters=given,
            before=None if self.previous is None else self.previous.question,
        )

    def _of_model(self, tree: ast.Query) -> Draft:
        """A model's statement, run. That it names a scene or revision that is not there is an error of its own."""
        try:
            return self._carried_out(by_score(of_objects(tree)), uncut_for_reranking=True)
        except StoreError as error:
            if error.span is None:
                raise
            raise BindError(error.message, hint=error.hint, span=error.span, source=error.source) from None

    def _carried_out(self, tree: ast.Query, *, uncut_for_reranking: bool = False, whole: bool = False) -> Draft:
        """The statement, run. whole: with all of its rows, however many."""
        tree, limit = self._framed(tree, most=None if whole else MOST_ROWS), None
        run = tree
        if uncut_for_reranking and self.reranker is not None:
            run, limit = uncut(tree, self.reranker.most)
        result = self.db.query(to_text(run), self.parameters, limits=self.limits)
        return Draft(tree=tree, result=replace(result, query=to_text(tree)), how="", limit=limit)

    def _framed(self, tree: ast.Query, *, most: int | None) -> ast.Query:
        """The statement in the scenes that were asked, with an end to its rows."""
        scenes = self.scenes or (self._scenes_before() if "$previous" in to_text(tree) else ())
        if scenes and not (most is None and tree.scenes):
            tree = replace(tree, scenes=tuple(ast.Text(value=name) for name in scenes))
        if self.as_of is not None:
            moment = ast.Text(value=self.as_of) if isinstance(self.as_of, str) else ast.Number(value=self.as_of)
            tree = replace(tree, as_of=moment)
        if most is not None and tree.limit is None and not returns_total(tree):
            tree = replace(tree, limit=ast.Number(value=most))
        return tree

    def _scenes_before(self) -> tuple[str, ...]:
        """The scenes that the answer before found something in: its ids mean nothing in others."""
        found = () if self.previous is None else self.previous.objects
        return tuple(dict.fromkeys(node.scene for node in found))

    def _other_way(self, draft: Draft) -> Draft:
        """The draft, or, where nothing fits it and something fits with an edge turned round, that."""
        if not draft.result.nothing_fits:
            return draft
        for tree, edge in turned(draft.tree):
            try:
                other = self._carried_out(tree, uncut_for_reranking=True)
            except QueryCancelled:
                raise
            except CgdbError:
                continue
            if not other.result.nothing_fits:
                label = "|".join(edge.labels) or "relation"
                self.warnings.append(f"nothing fits '{label}' as it was written; it was read the other way round")
                return other
        return draft

    def _built_in(self) -> Draft:
        from cgdb.english.translate import translate

        if not self.question or ("picture" in self.parameters and _LIKE_PICTURE.search(self.question)):
            return self._by_picture()
        question, among = self.question, False
        if self.previous is not None and self.previous.ids:
            back = follow_up(question, self.previous.ids)
            question, among = back.question, back.among
            self.parameters["previous"] = list(back.ids)
        there = "previous" in self.parameters
        setting = surveyed(self.views, previous=there)
        made = translate(question, self.catalog, setting=setting)
        if there and len(self.views) > 1 and (among or "$previous" in made.text):
            # What was found before is in some scenes, and asked in their words.
            self.views = [self.db.view(name, self.as_of) for name in self._scenes_before()]
            self.names = tuple(view.info.name for view in self.views)
            self.catalog = merge(view.catalog for view in self.views)
            setting = surveyed(self.views, previous=there)
            made = translate(question, self.catalog, setting=setting)
        tree, understood = made.query, tuple(made.understood)
        if among:
            tree = among_previous(tree)
            made = replace(made, query=tree)
        if "$previous" in to_text(tree):
            understood = (*understood, f"found before: {self._found_before()}")
        try:
            draft = self._carried_out(tree, uncut_for_reranking=True)
        except LimitError:
            draft = self._narrowed(tree)
        otherwise = loosened if draft.result.nothing_fits else widened
        if other := otherwise(made, self._result_of):
            made, draft = other, self._carried_out(other.query, uncut_for_reranking=True)
        if other := self._read_again(made, draft.result, setting):
            made, draft = other, self._carried_out(other.query, uncut_for_reranking=True)
            understood = tuple(dict.fromkeys((*understood, *other.understood)))  # first and second reading
        return replace(draft, how="built-in", understood=understood, wanted=made.wanted, made=made)

    def _result_of(self, tree: ast.Query) -> Result:
        return self._carried_out(tree).result

    def _read_again(self, made: Translation, found: Result, setting: Setting) -> Translation | None:
        """The question as it was read a second time, where nothing fits and something does so; else None."""
        from cgdb.english.second_reading import by_container, by_name
        from cgdb.english.translate import read_otherwise

        if not found.nothing_fits or "previous" in self.parameters or made.kind == "other language":
            return None
        named = by_name(self.question, made.asked, names(setting))
        held = by_container(made.asked)
        if held is not None and is_there(made, self._result_of):
            held = None  # "the cups in the box" that has none are cups
        for asked, note in (
            (named, "nothing fits as it was read at first: asked for the name in it that the map knows"),
            (held, "nothing is called so: asked for what holds it"),
        ):
            if asked is None:
                continue
            other = read_otherwise(asked, self.catalog, setting, note=note)
            result = self._result_of(other.query)
            if result.nothing_fits and (less := loosened(other, self._result_of)):
                return less
            if not result.nothing_fits:
                return other
        return None

    def _narrowed(self, tree: ast.Query) -> Draft:
        """The statement over what fits alone, where it outgrew a limit; the answer shows it as it was."""
        found = narrowed(tree, lambda one: self._carried_out(one, whole=True).result)
        if found is None:
            return self._carried_out(tree)
        draft = self._carried_out(found[0])
        self.warnings.extend(("of things that are compared, only those that fit were looked at", *found[1]))
        shown = self._framed(tree, most=MOST_ROWS)
        return replace(draft, tree=shown, result=replace(draft.result, query=to_text(shown)))

    def _found_before(self) -> str:
        ids = self.parameters["previous"]
        found = () if self.previous is None else self.previous.objects
        names = [str(node) for node in found if node.id in ids]
        return ", ".join(names[:3]) + (f" and {len(names) - 3:,} more" if len(names) > 3 else "")

    def _by_picture(self) -> Draft:
        draft = self._carried_out(best_of(like(ast.Parameter(name="picture")), 10))
        return replace(draft, how="built-in", understood=("what looks like the picture",))

    # -- the answer ---------------------------------------------------------------------------------------------

    def _shown_nearest(self, draft: Draft) -> Draft:
        """Where no row came at all: the nearest things, none of which fits."""
        if draft.result.rows or returns_total(draft.tree):
            return draft
        if draft.made is not None and self.reranker is None:
            return draft  # they are looked for with what each of them lacks
        near = self._nearest(draft, NEAREST)
        if not near:
            return draft
        return replace(draft, result=replace(draft.result, columns=("o",), rows=near), nearest=True)

    def _nearest(self, draft: Draft, count: int) -> tuple[Row, ...]:
        """The things that are nearest to what was wanted, whatever else was asked."""
        meaning = next((node.meaning for p in draft.tree.patterns for node in p.nodes if node.meaning), None)
        text = draft.wanted or (meaning.value if isinstance(meaning, ast.Text) else "") or self.asked
        found = self._carried_out(best_of(like(ast.Text(value=text[:LONGEST_QUESTION])), count)).result.rows
        return tuple(failing(row, draft.result.query) for row in found)

    def _reranked(self, draft: Draft) -> Answer | None:
        """The answer as a re-ranker orders it; None where there is none, it fails, or there is nothing to order."""
        reranker = self.reranker
        if reranker is None or (isinstance(reranker, ModelReranker) and (self.silent or self.meter.remaining <= 0)):
            return None
        if has_an_order(draft):
            return None
        best = shortlist(draft.result.rows, self._read_otherwise(draft, reranker.most), reranker.most)
        try:
            found = reordered(draft, self.asked, best, reranker, self.meter)
        except (ModelError, MissingExtraError) as error:
            self.warnings.append(f"the order is the map's own, for the model could not re-rank: {_line(error)}")
            return None
        self.warnings.extend(found.warnings)
        draft, said = found.draft, found.said
        if said is None:
            return replace(self._answer(self._explained(draft)), reranked=True, reranker=reranker.name)
        told = Explained(
            draft=draft,
            achievable=said.query_achievable,
            text=said.explanation,
            facts=facts(draft.tree, draft.result),
        )
        answer = replace(self._answer(told), inferred_query=said.inferred_query, relevant=found.relevant)
        return replace(answer, reranked=True, reranker=reranker.name)

    def _read_otherwise(self, draft: Draft, most: int) -> Iterator[Row]:
        """What the question finds, read by the built-in translator, then by its meaning alone."""
        if "$previous" in draft.result.query:
            return  # only what was found before can be the answer
        if draft.how != "built-in":
            warnings = list(self.warnings)
            rows: tuple[Row, ...] = ()
            try:
                rows = self._built_in().result.rows
            except QueryCancelled:
                raise
            except CgdbError:
                pass  # a second opinion that nobody asked for; nor are its warnings told
            self.warnings = warnings
            yield from (failing(row, draft.result.query) for row in rows if first_node(row) is not None)
        yield from self._nearest(draft, most)

    def _catalog_of(self, scene: str) -> Catalog:
        return self.db.view(scene, self.as_of).catalog

    def _explained(self, draft: Draft) -> Explained:
        """The answer in words; what is looked up for it is asked of the same scenes at the same time."""

        def whole(tree: ast.Query) -> Result:
            return self._carried_out(tree, whole=True).result

        def run(tree: ast.Query) -> Result:
            try:
                return whole(tree)
            except LimitError:
                found = narrowed(tree, whole)
                if found is None:
                    raise
                return whole(found[0])

        return explained(draft, self._catalog_of, self.names, run, MOST_ROWS)

    def _answer(self, found: Explained) -> Answer:
        draft = found.draft
        nodes = [node for row in draft.result.rows[:MOST_RELEVANT] if (node := first_node(row)) is not None]
        asked_model = self.model is not None and self.meter.usage.calls > 0
        return Answer(
            question=self.given,
            query=draft.result.query,
            understood=draft.understood or ((self.asked,) if self.asked != self.question else ()),
            result=draft.result,
            achievable=found.achievable,
            explanation=found.text,
            facts=found.facts,
            assumed=() if draft.made is None else draft.made.assumed,
            ignored=() if draft.made is None else draft.made.ignored,
            how=draft.how,
            usage=self.meter.usage,
            warnings=tuple(dict.fromkeys((*self.warnings, *draft.result.warnings))),
            relevant=tuple(dict.fromkeys(node.id for node in nodes)),
            model=self.model.name if self.model is not None and asked_model else None,
        )


def _line(error: CgdbError) -> str:
    return error.message + (f" ({error.hint})" if error.hint else "")
