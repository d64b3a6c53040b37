"""Reads a JUnit report with Python's own XML parser, as a server of continuous integration does, and prints what it says.

Fails on what servers refuse: another root, counts that are not those of the cases, a case without name or class, a
failure without text, or an attribute that the layout does not have.
"""

import json
import sys
import xml.etree.ElementTree as ElementTree

# Of the Jenkins xUnit plug-in's junit-10.xsd: what each element may and must have.
ATTRIBUTES = {
    "testsuites": ({"name", "time", "tests", "failures", "errors", "skipped"}, set()),
    "testsuite": (
        {"name", "tests", "failures", "errors", "skipped", "time", "timestamp", "hostname", "id"},
        {"name"},
    ),
    "properties": (set(), set()),
    "property": ({"name", "value"}, {"name"}),
    "testcase": ({"name", "classname", "time", "status"}, {"name", "classname", "time"}),
    "failure": ({"type", "message"}, {"type", "message"}),
    "error": ({"type", "message"}, {"type", "message"}),
    "skipped": ({"type", "message"}, set()),
    "system-out": (set(), set()),
}
CHILDREN = {
    "testsuites": {"testsuite"},
    "testsuite": {"properties", "testcase"},
    "properties": {"property"},
    "testcase": {"failure", "error", "skipped", "system-out"},
}


def check(element):
    allowed, needed = ATTRIBUTES[element.tag]
    assert set(element.keys()) <= allowed, (element.tag, element.keys())
    assert needed <= set(element.keys()), (element.tag, element.keys())
    for child in element:
        assert child.tag in CHILDREN.get(element.tag, set()), (element.tag, child.tag)
        check(child)


def main():
    root = ElementTree.parse(sys.argv[1]).getroot()
    assert root.tag == "testsuites", root.tag
    check(root)
    suites = list(root)
    assert len(suites) == 1, suites
    cases = suites[0].findall("testcase")
    names = [case.get("name") for case in cases]
    assert len(set(names)) == len(names), names
    outcomes = {}
    for case in cases:
        marks = [child for child in case if child.tag != "system-out"]
        assert len(marks) <= 1, case.get("name")
        outcomes[case.get("name")] = marks[0].tag if marks else "passed"
        for mark in marks:
            assert mark.get("message"), case.get("name")
            assert mark.tag == "skipped" or mark.text, case.get("name")
    for place in (root, suites[0]):
        assert int(place.get("tests")) == len(cases)
        for count, tag in (("failures", "failure"), ("errors", "error"), ("skipped", "skipped")):
            assert int(place.get(count)) == list(outcomes.values()).count(tag), count
    print(json.dumps(outcomes))


main()
