"""Where lines of Rust can be altered: sites of mutations, by regular expressions over source text
without comments, strings, attributes and parts that builds for tests or for other systems have."""

import re
from collections import namedtuple

# Line counts from 0; occurrence among equal lines of the function.
Site = namedtuple("Site", "kind line function old new occurrence")

# Of builds with default features on the system of the CI.
CONFIGURED = {"unix", "target_os = \"linux\"", "target_arch = \"x86_64\"", "feature = \"server\""}
LITERAL = re.compile(
    r"""//[^\n]*|/\*.*?\*/|\b[bc]?r(?P<hashes>#*)".*?"(?P=hashes)|\b[bc]?"(?:\\.|[^"\\])*"|"""
    r""""(?:\\.|[^"\\])*"|\bb?'(?:\\[^\n]+?|[^\\'\n])'|'(?:\\[^'\n]+|\\'|[^\\'\n])'""",
    re.S,
)
MODULE = re.compile(r'\s*(?:#\[path = "(.+?)"\]\s*)?(?:pub(?:\(.+?\))? )?mod (\w+);')
SCOPE = re.compile(
    r"\bfn (\w+)|^ *(?:unsafe )?(impl\b[^{;]*)|\btrait (\w+)|\bmod (\w+)|([()\[\]{};])", re.M
)
# Begin of an item that ends with `;` or a block; others end at the next comma.
ITEM = re.compile(r"\s*(?:pub|fn|impl|mod|use|struct|enum|trait|const|static|type|unsafe|let)\b")
INTEGER, FLOAT = r"0x[\da-fA-F_]+|\d[\d_]*", r"\d[\d_]*\.\d[\d_]*(?:e-?\d+)?|\d[\d_]*e-?\d+"
NUMBER = re.compile(
    rf"(?<![\w])(?<![\w)\]?]\.)(?:(?P<float>{FLOAT})|(?P<integer>{INTEGER}))"
    r"(?P<suffix>_?(?:[iu]\d+|[iu]size|f64|f32))?(?![\w\]]|\.\w)"
)
SWAPS = [
    ("sum", r"(?<= )[+-](?= )|(?<= )[+-](?==)", {"+": "-", "-": "+"}),
    ("product", r"(?<= )[*/](?= )|(?<= )[*/](?==)", {"*": "/", "/": "*"}),
    ("order", r"(?<= )[<>]=?(?= )", {"<": "<=", "<=": "<", ">": ">=", ">=": ">"}),
    ("equality", r"(?<= )[!=]=(?= )", {"==": "!=", "!=": "=="}),
    ("connective", r"(?<=[^=(,] )(?:&&|\|\|)(?= )", {"&&": "||", "||": "&&"}),
    ("truth", r"\b(?:true|false)\b", {"true": "false", "false": "true"}),
    ("extreme", r"(?<=\.)(?:min|max)(?=\()", {"min": "max", "max": "min"}),
    ("negation", r"(?<![\w!])!(?=[\w(])", {"!": ""}),
]
ASSIGNMENT = re.compile(r"\s*\*?(?!let\b|const\b|static\b|type\b)[\w.\[\]]+ (?:[-+*/%&|^]|<<|>>)?= .*;")
CALL = re.compile(r"\s*[a-z_]\w*(?:\.\w+|\[[^\]]*\]|\(\))*\.\w+\(.*\);")
BOUNDS = re.compile(r"\b(?:impl|dyn|where|trait|use|type)\b|'static|\$|: [A-Z]\w* \+")


def blank(text, start, end):
    return text[:start] + re.sub(r"[^\n]", " ", text[start:end]) + text[end:]


def end_of(text, start, stops):
    """End of what begins at an index: a stop outside of brackets, or the bracket that closes it."""
    depth = 0
    for index in range(start, len(text)):
        depth += (text[index] in "([{") - (text[index] in ")]}")
        if depth < 0:
            return index
        if depth == 0 and text[index] in stops:
            return index + 1
    return len(text)


def configured(condition):
    """Whether a condition of `cfg` holds."""
    atoms = r'\w+ = "[^"]*"|\b(?!(?:not|all|any)\()\w+\b'
    told = re.sub(atoms, lambda atom: str(atom[0] in CONFIGURED), condition)
    told = told.replace("all(", "both(").replace("any(", "either(")
    return eval(told, {"both": lambda *of: all(of), "either": lambda *of: any(of)})


def masked(text):
    """The text with blanks where nothing is altered, and the modules, by name or path, that the
    build does not have."""
    code = LITERAL.sub(lambda found: blank(found[0], 0, len(found[0])), text)
    absent = []
    while found := re.search(r"#!?\[", code):
        end = end_of(code, found.end() - 1, "]")
        condition = re.match(r"#!?\[cfg\((.*)\)\]$", text[found.start():end], re.S)
        if condition and not configured(condition[1]):
            if module := MODULE.match(text, end):
                absent.append(module[1] or module[2])
            # Further attributes of the item go with it.
            while again := re.match(r"\s*#\[", code[end:]):
                end = end_of(code, end + again.end() - 1, "]")
            inner = code[found.start() + 1] == "!"
            end = len(code) if inner else end_of(code, end, ";}" if ITEM.match(code, end) else ",;}")
        code = blank(code, found.start(), end)
    return code, absent


def sources(folder):
    """Files of a folder that can be altered."""
    files, absent = sorted(folder.rglob("*.rs")), set()
    for file in files:
        inside = file.parent if file.stem in ("lib", "main", "mod") else file.with_suffix("")
        for name in masked(file.read_text())[1]:
            if name.endswith(".rs"):
                absent.add(file.parent / name)
            else:
                absent |= {inside / f"{name}.rs", inside / name}
    return [file for file in files if not absent & {file, *file.parents}]


def functions(code):
    """The function of each line, with the types and modules around it."""
    names, stack, pending, depth, at = [""] * (code.count("\n") + 1), [], None, 0, 0
    line = 0
    for found in SCOPE.finditer(code):
        here = code.count("\n", at, found.start())
        for index in range(line + 1, line + here + 1):
            names[index] = "::".join(filter(None, stack))
        line, at = line + here, found.start()
        mark = found[5]
        if not mark:
            pending = found[1] or found[3] or found[4] or implemented(found[2])
        elif mark == "{":
            stack.append(pending)
            pending = None
            names[line] = max(names[line], "::".join(filter(None, stack)), key=len)
        elif mark == "}":
            stack = stack[:-1]
        elif mark == ";" and depth == 0:
            pending = None
        depth += (mark in ("(", "[")) - (mark in (")", "]")) if mark else 0
    return names


def implemented(header):
    """The type of an `impl`."""
    while (shorter := re.sub(r"<[^<>]*>", "", header.replace("->", ""))) != header:
        header = shorter
    words = re.findall(r"\w+", header.split(" where ")[0].split(" for ")[-1])
    return words[-1] if words else ""


def altered_number(found):
    if found["float"]:
        value = float(found["float"].replace("_", ""))
        text = f"{value * 1.01:.12g}" if value else "1.0"
        return (text if re.search(r"[.e]", text) else f"{text}.0") + (found["suffix"] or "")
    text = found["integer"].replace("_", "")
    value = f"{int(text, 16) + 1:#x}" if text.startswith("0x") else str(int(text) + 1)
    return value + (found["suffix"] or "")


def alterations(code, text, before):
    """Kind and new text of each alteration of a line; `before` is the code before it."""
    if not code.strip() or BOUNDS.search(code):
        return
    for kind, pattern, swaps in SWAPS:
        for found in re.finditer(pattern, code):
            yield kind, text[:found.start()] + swaps[found[0]] + text[found.end():]
    for found in NUMBER.finditer(code):
        yield "number", text[:found.start()] + altered_number(found) + text[found.end():]
    whole = all(code.count(a) == code.count(b) for a, b in ("()", "[]", "{}"))
    if whole and before.rstrip()[-1:] in (";", "{", "}"):
        if ASSIGNMENT.fullmatch(code.rstrip()) or CALL.fullmatch(code.rstrip()):
            yield "statement", ""


def keys(text):
    """Function, text and occurrence of each line, by which it is found again."""
    code, _ = masked(text)
    seen, found = {}, []
    for function, line in zip(functions(code), text.split("\n")):
        key = (function, line.strip())
        seen[key] = seen.get(key, 0) + 1
        found.append((*key, seen[key]))
    return found


def sites(text):
    code, _ = masked(text)
    found, before, lines = [], "", text.split("\n")
    for line, (masked_line, key) in enumerate(zip(code.split("\n"), keys(text))):
        function, old, occurrence = key
        # Outside of functions there are types, of which nearly all numbers are lengths.
        if function or re.search(r"\b(?:const|static)\b", masked_line):
            found += [
                Site(kind, line, function, old, new.strip(), occurrence)
                for kind, new in alterations(masked_line, lines[line], before)
            ]
        before = masked_line if masked_line.strip() else before
    return found
