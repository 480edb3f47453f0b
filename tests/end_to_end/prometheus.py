# SPDX-License-Identifier: MIT
"""A strict reader of Prometheus' text format, version 0.0.4: refuses what a collector would refuse
or could misread."""

import math
import re

NAME = re.compile(r"[a-zA-Z_:][a-zA-Z0-9_:]*")
LABEL = re.compile(r"[a-zA-Z_][a-zA-Z0-9_]*")
TYPES = ("counter", "gauge", "histogram", "summary", "untyped")
SUFFIXES = {"histogram": ("_bucket", "_sum", "_count"), "summary": ("", "_sum", "_count")}


class Malformed(Exception):
    pass


def require(condition, *what):
    if not condition:
        raise Malformed(*what)


def parse_labels(text, line):
    """The labels after "{", and what follows "}"."""
    labels, at = {}, 0
    while text[at:at + 1] != "}":
        name = LABEL.match(text, at)
        require(name, "label name", line)
        at = name.end()
        require(text.startswith('="', at), "label value", line)
        at += 2
        value = ""
        while text[at:at + 1] != '"':
            require(at < len(text), "label not closed", line)
            if text[at] == "\\":
                require(text[at + 1:at + 2] in ("\\", '"', "n"), "escape", line)
                value += {"\\": "\\", '"': '"', "n": "\n"}[text[at + 1]]
                at += 1
            else:
                value += text[at]
            at += 1
        at += 1
        require(name.group() not in labels, "label twice", line)
        labels[name.group()] = value
        if text[at:at + 1] == ",":
            at += 1
        else:
            require(text[at:at + 1] == "}", "label list", line)
    return labels, text[at + 1:]


def parse_number(text, line):
    if text in ("NaN", "+Inf", "-Inf"):
        return float(text)
    require(re.fullmatch(r"[-+]?(\d+(\.\d*)?|\.\d+)([eE][-+]?\d+)?", text), "number", line)
    return float(text)


def parse(data):
    """{family: (type, help, {sample name and sorted labels: value})} of the file's bytes."""
    text = data.decode("utf-8")
    require(text.endswith("\n") and not text.endswith("\n\n"), "last line")
    require("\r" not in text, "carriage return")
    families, current, helps = {}, None, {}
    for line in text.split("\n")[:-1]:
        if line.startswith("# HELP "):
            name, _, words = line[7:].partition(" ")
            require(NAME.fullmatch(name) and words, "HELP", line)
            require(name not in helps, "HELP twice", line)
            helps[name], current = words, None
        elif line.startswith("# TYPE "):
            words = line[7:].split(" ")
            require(len(words) == 2 and words[1] in TYPES, "TYPE", line)
            name, kind = words
            require(name in helps, "TYPE without HELP", line)
            require(name not in families, "TYPE twice", line)
            families[name], current = (kind, helps[name], {}), name
        else:
            require(line and not line.startswith("#"), "unknown line", line)
            require(current is not None, "sample outside of its family", line)
            name = NAME.match(line)
            require(name, "sample name", line)
            rest, labels = line[name.end():], {}
            if rest.startswith("{"):
                labels, rest = parse_labels(rest[1:], line)
            require(re.fullmatch(r" \S+", rest), "one value, no time", line)
            kind, _, samples = families[current]
            require(name.group() in [current + s for s in SUFFIXES.get(kind, ("",))],
                    "name of another family", line)
            key = (name.group(), tuple(sorted(labels.items())))
            require(key not in samples, "sample twice", line)
            samples[key] = parse_number(rest[1:], line)
    for name, (kind, _, samples) in families.items():
        require(kind != "counter" or name.endswith("_total"), "counters end in _total", name)
        require(kind != "counter" or all(v >= 0 for v in samples.values()), "negative", name)
        if kind == "histogram":
            check_histogram(name, samples)
    require(set(helps) == set(families), "HELP without TYPE")
    return families


def check_histogram(name, samples):
    series = {}
    for (sample, labels), value in samples.items():
        rest = tuple(pair for pair in labels if pair[0] != "le")
        series.setdefault(rest, {})[(sample, dict(labels).get("le"))] = value
    for parts in series.values():
        buckets = [(parse_number(le, name), value) for (sample, le), value in parts.items()
                   if sample == name + "_bucket"]
        require(buckets == sorted(buckets), "buckets ascend", name)
        require(all(a[1] <= b[1] for a, b in zip(buckets, buckets[1:])), "cumulative", name)
        require(buckets and math.isinf(buckets[-1][0]), "+Inf", name)
        require(buckets[-1][1] == parts[(name + "_count", None)], "count", name)
        require((name + "_sum", None) in parts, "sum", name)
