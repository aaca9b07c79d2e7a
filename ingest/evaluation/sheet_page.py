"""A sheet as a web page: one file with its pictures, in which a person judges by clicking and saves the filled-in form.

Nothing of a map becomes markup: it lies in the page as JSON data, in which no element can end, and the page's program
shows it as text. The page may load nothing and send nothing.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Iterable, Iterator

from cgdb.scene import image_type

_HEAD = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<meta http-equiv="Content-Security-Policy"
 content="default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'">
<title>Scene graph sheet</title>
<style>
body { font: 16px/1.4 system-ui, sans-serif; max-width: 60em; margin: 0 auto; padding: 1em 1em 6em; }
section { border-top: 1px solid #8884; padding: .6em 0; }
img { height: 9em; max-width: 18em; object-fit: contain; margin: 0 .4em .4em 0; background: #8882; }
h3 { font-size: 1em; margin: .2em 0; }
p { margin: .2em 0; }
label { margin-right: 1em; }
.question { display: inline-block; min-width: 17em; }
#bar { position: fixed; bottom: 0; left: 0; right: 0; padding: .6em 1em; background: Canvas; border-top: 1px solid; }
:root { color-scheme: light dark; }
</style>
</head>
<body>
<h1>Scene graph sheet</h1>
<noscript>This page needs JavaScript; the form can also be filled in with an editor.</noscript>
<p id="how"></p>
<main id="main"></main>
<div id="bar"><input id="person" placeholder="your name" aria-label="your name">
<button id="save" type="button">Save the form</button> <span id="left"></span></div>
"""

_PROGRAM = """<script>
"use strict";
const read = (id) => JSON.parse(document.getElementById(id).textContent);
const sheet = read("sheet"), pictures = read("pictures"), open = new Set();
const words = {
  object: "one whole thing?", label_right: "tag and caption are right?", duplicate: "an earlier one is the same thing?",
  right: "does this hold?",
};
const add = (parent, kind, text) => {
  const made = parent.appendChild(document.createElement(kind));
  if (text !== undefined) made.textContent = text;
  return made;
};
const tell = () => { document.getElementById("left").textContent = "open questions: " + open.size; };
let number = 0;
const ask = (parent, record, question) => {
  const line = add(parent, "p"), name = "q" + number++;
  add(line, "span", words[question]).className = "question";
  for (const [text, value] of [["yes", true], ["no", false], ["cannot tell", null]]) {
    const label = add(line, "label"), input = add(label, "input");
    input.type = "radio";
    input.name = name;
    input.checked = value !== null && record[question] === value;
    input.onchange = () => { record[question] = value; open.delete(name); tell(); };
    label.append(" " + text);
  }
  if (record[question] === null) open.add(name);
};
document.getElementById("how").textContent = sheet.how;
const main = document.getElementById("main");
for (const scene of sheet.scenes) {
  add(main, "h2", scene.scene);
  for (const node of scene.nodes) {
    const part = add(main, "section");
    add(part, "h3", "#" + node.id + " " + (node.tag ?? "(no tag)"));
    if (node.caption) add(part, "p", node.caption);
    for (const name of node.pictures ?? []) {
      if (!(name in pictures)) continue;
      const image = add(part, "img");
      image.src = pictures[name];
      image.alt = name;
    }
    const where = [];
    if (node.extent) where.push("size " + node.extent.join(" x ") + " m");
    if (node.frames) where.push("frames " + node.frames.join(", "));
    if (where.length) add(part, "p", where.join("; "));
    for (const question of ["object", "label_right", "duplicate"]) ask(part, node, question);
  }
  if (scene.edges.length) add(main, "h2", scene.scene + ": relations");
  for (const edge of scene.edges) {
    const part = add(main, "section");
    add(part, "h3", edge.says);
    ask(part, edge, "right");
  }
}
tell();
const person = document.getElementById("person");
person.value = sheet.person;
document.getElementById("save").onclick = () => {
  sheet.person = person.value;
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([JSON.stringify(sheet, null, 1)], { type: "application/json" }));
  link.download = "sheet-" + (person.value.replace(/[^A-Za-z0-9]+/g, "-") || "filled-in") + ".json";
  link.click();
};
</script>
</body>
</html>
"""


def page(sheet: str, pictures: Iterable[tuple[str, bytes]]) -> Iterator[str]:
    """The page in pieces. sheet: the text of a sheet. pictures: the files that it names, one in memory at a time."""
    yield _HEAD
    yield f'<script type="application/json" id="sheet">{_inert(sheet)}</script>\n'
    yield '<script type="application/json" id="pictures">{'
    before = ""
    for name, image in pictures:
        data = f"data:{image_type(image) or 'image/jpeg'};base64,{base64.b64encode(image).decode('ascii')}"
        yield f"{before}\n{_inert(json.dumps(name))}: {json.dumps(data)}"
        before = ","
    yield "}</script>\n"
    yield _PROGRAM


def _inert(text: str) -> str:
    """JSON as it is, but that no mark in it can end or begin an element; it says the same."""
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
