"""Results of a long measurement, kept a file each, so that it can be stopped and goes on."""

import json
import re


def write_whole(path, text):
    """A run that is stopped meanwhile leaves what was there."""
    part = path.with_name(path.name + ".part")
    part.write_text(text, encoding="utf-8")
    part.replace(path)


class Kept:
    """What is done already, in a folder that a later run goes on from; without one nothing is kept."""

    def __init__(self, folder):
        self.folder = folder
        if folder:
            folder.mkdir(parents=True, exist_ok=True)

    def __call__(self, name, make):
        path = self.folder and self.folder / (re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-") + ".json")
        if path and path.exists():
            return json.loads(path.read_text(encoding="utf-8"))
        result = make()
        if path:
            write_whole(path, json.dumps(result))
        return result
