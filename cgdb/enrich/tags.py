"""Tagging: objects without a name get the names of a vocabulary that are nearest to their image features.

Where names are brought into the space of the features, by CLIP or by vectors that were computed elsewhere, the nearest
is what the thing most looks like: a tag without a language model. What a map or a person calls a thing is kept.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import CgdbError, EncoderError, StoreError, UsageError, one_of
from cgdb.meaning.embed import Encoder
from cgdb.meaning.encoders import Encoders
from cgdb.meaning.names import read_names
from cgdb.meaning.vocabulary import Vocabulary
from cgdb.scene import PropertyValue, SceneObject
from cgdb.storage.text_vectors import TextVectors

if TYPE_CHECKING:
    from cgdb.database import Database

PROMPT = "a photo of a {}"
AT_ONCE = 256
"""Names that are encoded between two words on how far it is."""
OBJECTS = 2048
NO_NAMES = ("_text", "dinov2", "color")
"""How spaces end in which names of things seen do not lie: of the labels' own vectors, and of no texts at all."""
ORIGIN = ("tagged_by", "tag_scores", "tag_before")
"""Properties: which encoder gave tag and tags, the cosines of the tags, and what the thing was called before."""

Floats = NDArray[np.float32]


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneTags:
    """What was done with a scene. named: had a name, which was kept; unseen: have no features that a name can meet."""

    scene: str
    objects: int
    tagged: int
    named: int
    unseen: int
    revision: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """How far it is."""

    what: str
    done: int
    total: int


class Tagging:
    """The work on some scenes of a store: go through ``run``, then see ``scenes``."""

    def __init__(
        self,
        db: Database,
        vocabulary: str | Path | Sequence[str],
        *,
        scenes: Sequence[str] = (),
        space: str | None = None,
        top: int = 5,
        replace: bool = False,
        encoders: Mapping[str, Encoder] | None = None,
    ) -> None:
        """vocabulary: names, a file of them, or one of names with their vectors, which needs no encoder.

        space: the feature space to compare in; else the first whose encoder can be had. top: tags of an object.
        replace: tag named things, too. encoders: {space: encoder} beside those that the maps name.
        """
        if top < 1:
            raise UsageError(f"an object gets at least one tag, not {top}")
        self._db, self._space, self._top, self._replace = db, space, top, replace
        self._wanted = list(dict.fromkeys(scenes)) or [info.name for info in db.scenes()]
        self._given, self.names = open_vocabulary(vocabulary)
        self._kept = TextVectors(db.path / "texts.sqlite", read_only=db.read_only)
        self._encoders = Encoders(self._kept, text=None, spaces=encoders)
        self._vectors: dict[str, Floats] = {}
        self.scenes: tuple[SceneTags, ...] = ()

    def run(self, *, write: bool = True) -> Iterator[Step]:
        """Tag, one revision per scene that changes, yielding how far it is; write False: only find what would be.

        EncoderError or MissingExtraError where the names cannot be brought into the space of any feature.
        """
        if write and self._db.read_only:
            raise StoreError(f"{self._db.path} cannot be written, so nothing would be kept")
        # Known before hours of encoding: whether there is anything to compare with.
        usable = {name: self._usable(name) for name in self._wanted}
        if not any(usable.values()):
            raise self._why_not()
        try:
            for name, spaces in usable.items():
                for encoder in spaces.values():
                    yield from self._encode(encoder)
                yield from self._tag(name, spaces, write)
        finally:
            self._kept.close()

    # -- the vocabulary -----------------------------------------------------------------------------------------

    def _usable(self, scene: str) -> dict[str, Encoder]:
        """{space: its encoder} of the spaces of pictures that names can be brought into, in the map's order."""
        info = self._db.view(scene).info
        found = {}
        for space in info.spaces:
            if (space.name != self._space) if self._space is not None else space.name.endswith(NO_NAMES):
                continue
            encoder: Encoder | CgdbError | None = self._given
            if self._given is None or self._given.dimension != space.dimension:
                encoder = self._encoders.space(space)
            if encoder is None or isinstance(encoder, CgdbError):
                continue
            if encoder.dimension != space.dimension:
                raise EncoderError(
                    f"scene '{scene}': its space '{space.name}' has {space.dimension} dimensions, {encoder.name} has "
                    f"{encoder.dimension}"
                )
            found[space.name] = encoder
        return found

    def _why_not(self) -> CgdbError:
        spaces = {space.name: space for name in self._wanted for space in self._db.view(name).info.spaces}
        if not spaces:
            return UsageError("no object has features, so there is nothing to compare names with")
        if self._space is not None and self._space not in spaces:
            return UsageError(f"no scene has a feature space '{self._space}'", hint=f"there are {one_of(spaces)}")
        for space in spaces.values():
            found = self._encoders.space(space)
            if isinstance(found, CgdbError):
                return found
        name = next(iter(spaces))
        return EncoderError(
            f"the map does not say what made its features ({one_of(spaces)}), so names cannot be compared with them",
            hint=f"--encoder {name}=open_clip:MODEL:WEIGHTS, or a vocabulary that holds vectors (.npz)",
        )

    def _encode(self, encoder: Encoder) -> Iterator[Step]:
        if encoder.name in self._vectors:
            return
        texts = [name if encoder is self._given else PROMPT.format(name) for name in self.names]
        parts = []
        for start in range(0, len(texts), AT_ONCE):
            batch = texts[start : start + AT_ONCE]
            # The store keeps what a model made: the next run has it at once. What a file holds it need not keep.
            made = encoder.texts(batch) if isinstance(encoder, Vocabulary) else self._encoders.encode(encoder, batch)
            parts.append(made)
            yield Step(what="encoding the vocabulary", done=start + len(batch), total=len(texts))
        self._vectors[encoder.name] = np.concatenate(parts)

    # -- objects ------------------------------------------------------------------------------------------------

    def _tag(self, name: str, spaces: Mapping[str, Encoder], write: bool) -> Iterator[Step]:
        changed: list[SceneObject] = []
        seen = 0
        message = f"tags from {len(self.names):,} names"
        writing = self._db.write(name, kind="tag", on_existing="merge", message=message) if write else nullcontext()
        with writing as writer:
            # Read while nobody else can write: what a mapper that runs beside has added since is not undone.
            scene = self._db.scene(name)
            free = [obj for obj in scene.objects if self._replace or obj.tag is None or _is_ours(obj)]
            for start in range(0, len(free), OBJECTS):
                some = free[start : start + OBJECTS]
                left = some
                for space, encoder in spaces.items():
                    # To a vector without a length every name is as near as any other.
                    these = [obj for obj in left if space in obj.features and obj.features[space].any()]
                    taken = {obj.id for obj in these}
                    left = [obj for obj in left if obj.id not in taken]
                    if these:
                        seen += len(these)
                        made = self._tagged(these, space, encoder)
                        changed += [new for old, new in zip(these, made, strict=True) if _said(new) != _said(old)]
                yield Step(what=f"tagging {name}", done=start + len(some), total=len(free))
            if writer is not None:
                writer.objects(changed)
        revision = None if writer is None else writer.revision
        report = SceneTags(
            scene=name,
            objects=len(scene.objects),
            tagged=len(changed),
            named=len(scene.objects) - len(free),
            unseen=len(free) - seen,
            revision=revision,
        )
        self.scenes = (*self.scenes, report)

    def _tagged(self, objects: Sequence[SceneObject], space: str, encoder: Encoder) -> list[SceneObject]:
        features = np.stack([obj.features[space] for obj in objects]).astype(np.float32)
        features /= np.maximum(np.linalg.norm(features, axis=1, keepdims=True), 1e-12)
        near = features @ self._vectors[encoder.name].T
        top = min(self._top, len(self.names))
        order = np.argsort(-near, axis=1, kind="stable")[:, :top]
        made = []
        for obj, row, chosen in zip(objects, near, order, strict=True):
            names = tuple(self.names[i] for i in chosen.tolist())
            own = {key: value for key, value in obj.properties.items() if key not in ORIGIN[:2]}
            if obj.tag is not None and not _is_ours(obj):
                own.setdefault("tag_before", obj.tag)
            origin: dict[str, PropertyValue] = {
                "tagged_by": encoder.name,
                "tag_scores": tuple(round(float(score), 4) for score in row[chosen]),
            }
            made.append(replace(obj, tag=names[0], tags=names, properties={**own, **origin}))
        return made


def open_vocabulary(vocabulary: str | Path | Sequence[str]) -> tuple[Vocabulary | None, tuple[str, ...]]:
    """(the names with their vectors, where the vocabulary has vectors; its names)."""
    if isinstance(vocabulary, str | Path):
        path = Path(vocabulary).expanduser()
        if path.suffix in (".npz", ".npy") or (path.suffix == ".json" and path.with_suffix(".npy").is_file()):
            given = Vocabulary.load(path)
            return given, given.names
        return None, tuple(read_names(path))
    names = tuple(dict.fromkeys(" ".join(name.split()) for name in vocabulary if name.strip()))
    if not names:
        raise UsageError("a vocabulary holds at least one name")
    return None, names


def _is_ours(obj: SceneObject) -> bool:
    """Whether its tag came from here: a person who renames a thing leaves its tags as they were."""
    return "tagged_by" in obj.properties and bool(obj.tags) and obj.tag == obj.tags[0]


def _said(obj: SceneObject) -> tuple[object, ...]:
    return obj.tag, obj.tags, dict(obj.properties)
