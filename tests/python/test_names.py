"""The stub, the module and the documentation name the same things."""
import ast
import inspect
import pathlib

import pytest

import ist

def stub_of(name):
    return ast.parse((pathlib.Path(ist.__file__).parent / name).read_text())


STUB = stub_of("__init__.pyi")
GPU_STUB = stub_of("gpu.pyi")
ENUMS = (ist.QueryStatus, ist.YesNo, ist.ImpactKind)


def public(module):
    return {name for name in vars(module) if not name.startswith("_")}


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
        elif isinstance(node, ast.ImportFrom) and node.module is None:
            names.update({name.asname: None for name in node.names if name.asname})
    return {name: what for name, what in names.items()
            if not name.startswith("_") or name in ("__init__", "__version__")}


def test_the_stubs_name_what_the_modules_have():
    assert set(stub_names(STUB.body)) == set(ist.__all__)
    assert set(stub_names(GPU_STUB.body)) == public(ist.gpu)


@pytest.mark.parametrize("stub, module", [(STUB, ist), (GPU_STUB, ist.gpu)])
def test_the_stubs_classes_name_what_theirs_have(stub, module):
    for name, members in stub_names(stub.body).items():
        cls = getattr(module, name)
        if isinstance(members, dict) and cls not in ENUMS and not name.endswith("Error"):
            assert {m for m in members if m != "__init__"} == public(cls), name
    for enum in ENUMS:
        assert stub_names(STUB.body)[enum.__name__].keys() == enum.__members__.keys()


@pytest.mark.parametrize("stub, module", [(STUB, ist), (GPU_STUB, ist.gpu)])
def test_the_stubs_functions_take_what_theirs_take(stub, module):
    for name, arguments in stub_names(stub.body).items():
        if isinstance(arguments, list):
            assert list(inspect.signature(getattr(module, name)).parameters) == arguments, name


def test_everything_is_documented():
    for value in [getattr(ist, n) for n in ist.__all__] + [getattr(ist.gpu, n) for n in public(ist.gpu)]:
        if inspect.isclass(value) or inspect.ismodule(value) or callable(value):
            assert value.__doc__ and len(value.__doc__) > 10, value
    for cls in (ist.Penetration, ist.Separation, ist.ContactPatches, ist.TimeOfImpact, ist.gpu.Array,
                ist.Solids, ist.gpu.ContactPatches, ist.gpu.Penetration, ist.gpu.Separation):
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
