"""python3 twins.py ROOT

Fails on a formula that stands in two rooms: eight statements in a row with the same operators, whatever
their names, numbers and calls. Fails on a type (class or struct name) that two headers define in one namespace.
"""

import collections
import pathlib
import re
import sys

STATEMENTS = 8  # in a row that have operators
ARITHMETIC = 12  # operators in them: fewer are loops and assignments

UNSEEN = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"|^\s*#(?:[^\n]*\\\n)*[^\n]*', re.S | re.M)


def statements(text):
    """(line, operators) of each statement that has some."""
    text = UNSEEN.sub(lambda found: re.sub(r"[^\n]", " ", found[0]), text)
    line = 1
    for statement in re.split(r"([;{}])", text):
        operators = re.sub(r"[^-+*/=<>?!]", "", statement.replace("->", ""))
        if operators:
            yield line, operators
        line += statement.count("\n")


def formulas(root, files):
    """{operators of statements in a row: {room: place}}"""
    found = collections.defaultdict(dict)
    for path in files:
        lines = list(statements((root / path).read_text(encoding="utf-8")))
        for at in range(len(lines) - STATEMENTS + 1):
            window = tuple(operators for _, operators in lines[at : at + STATEMENTS])
            arithmetic = re.findall(r"[-+*/]", "".join(window).replace("++", ""))
            if len(arithmetic) >= ARITHMETIC and len(set(window)) > 1:
                found[window].setdefault("/".join(path.parts[:2]), f"{path}:{lines[at][0]}")
    return found


def types(root, headers):
    """{namespace and name: headers}; clang-format leaves those of a namespace unindented."""
    found = collections.defaultdict(set)
    for path in headers:
        spaces = []
        for line in (root / path).read_text(encoding="utf-8").split("\n"):
            if opened := re.match(r"(?:inline )?namespace ([\w:]*)", line):
                spaces.append(opened[1])
            elif line.startswith("}  // namespace"):
                spaces.pop()
            elif made := re.match(r"(?:template .*> )?(?:class|struct|union)(?: alignas\([^)]*\))?"
                                  r"(?: IST_[A-Z_]+)? (\w+)(?: final)?(?: : [^;]*)? {", line):
                found["::".join([*spaces, made[1]])].add(str(path))
    return found


def main(root):
    def sources(*folders, endings):
        return [path.relative_to(root) for folder in folders
                for path in sorted((root / folder).rglob("*")) if path.suffix in endings]

    errors = []
    known = formulas(root, sources("src", "ist", "cuda", endings={".h", ".cpp", ".cu"}))
    said = set()
    for places in known.values():
        pair = tuple(sorted(place.split(":")[0] for place in places.values()))
        if len(places) > 1 and pair not in said:
            said.add(pair)
            errors.append("one formula: " + " and ".join(places.values()))
    made = types(root, sources("include", "src", "ist", "cuda", "python/src", endings={".h"}))
    errors += [f"{name}: in " + " and ".join(sorted(where)) for name, where in sorted(made.items())
               if len(where) > 1]
    if len(made) < 300 or len(known) < 1000:
        errors.append(f"only {len(made)} types and {len(known)} formulas: has their form changed?")
    print("\n".join(errors) or f"{len(made)} types, {len(known)} formulas: none stands twice")
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1])))
