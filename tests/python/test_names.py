"""The stub, the module and the documentation name the same things."""
import ast
import inspect
import pathlib

import ist

STUB = ast.parse((pathlib.Path(ist.__file__).parent / "__init__.pyi").read_text())


def stub_names(nodes):
    """Public names, and of classes theirs."""
    names = {}
    for node in nodes:
        if isinstance(node, ast.ClassDef):
            names[node.name] = stub_names(node.body)
        elif isinstance(node, ast.FunctionDef):
            names[node.name] = [a.arg for a in node.args.posonlyargs + node.args.args
                                + node.args.kwonlyargs if a.arg != "self"]
        elif isinstance(node, (ast.Assign, ast.AnnAssign)):
            for target in node.targets if isinstance(node, ast.Assign) else [node.target]:
                names[target.id] = None
    return {name: what for name, what in names.items()
            if not name.startswith("_") or name in ("__init__", "__version__")}


def test_the_stub_names_what_the_module_has():
    assert set(stub_names(STUB.body)) == set(ist.__all__)


def test_the_stubs_classes_name_what_theirs_have():
    for name, members in stub_names(STUB.body).items():
        if isinstance(members, dict) and not name.endswith("Error") and name not in (
                "QueryStatus", "Overlapping", "ImpactStatus"):
            cls = getattr(ist, name)
            found = {m for m in vars(cls) if not m.startswith("_")}
            assert {m for m in members if m != "__init__"} == found, name
    for enum in (ist.QueryStatus, ist.Overlapping, ist.ImpactStatus):
        assert stub_names(STUB.body)[enum.__name__].keys() == enum.__members__.keys()


def test_the_stubs_functions_take_what_theirs_take():
    """A signature stands in the first line of a compiled function's text."""
    for name, arguments in stub_names(STUB.body).items():
        if isinstance(arguments, list):
            line = getattr(ist, name).__doc__.partition("\n")[0]
            assert all(f"{a}:" in line for a in arguments), (name, line)
            assert line.count(": ") == len(arguments), (name, line)


def test_everything_is_documented():
    for name in ist.__all__:
        value = getattr(ist, name)
        if inspect.isclass(value) or callable(value):
            assert value.__doc__ and len(value.__doc__) > 10, name
    for cls in (ist.Penetration, ist.Separation, ist.ContactPatches, ist.TimeOfImpact):
        for member, value in vars(cls).items():
            if not member.startswith("_"):
                assert value.__doc__, (cls, member)


def test_the_package_says_that_it_is_typed():
    assert (pathlib.Path(ist.__file__).parent / "py.typed").exists()


def test_the_module_shows_one_symbol():
    import subprocess
    shown = subprocess.run(["nm", "-D", "--defined-only", ist._core.__file__], check=True,
                           capture_output=True, text=True).stdout.split()
    assert shown[2::3] == ["PyInit__core"]
