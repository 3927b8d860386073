"""Calls of compiled functions whose mistakes name the argument."""

import difflib
import functools
import inspect
import numbers
import re

_KINDS = {
    "int": (numbers.Integral, "a whole number ≥ 0"),
    "float": (numbers.Real, "a number"),
    "str": (str, "a str"),
    "bool": (bool, "True or False"),
}


def signature_of(overload):
    """The signature of an overload of a compiled function; annotations are strings."""
    text, _, defaults = overload
    kind, parameters = inspect.Parameter.POSITIONAL_OR_KEYWORD, []
    for part in re.split(r", (?![^\[]*\])", text[text.index("(") + 1:text.rindex(") ->")]):
        name, _, rest = part.partition(": ")
        if name == "*":
            kind = inspect.Parameter.KEYWORD_ONLY
        elif name == "/":
            parameters = [p.replace(kind=inspect.Parameter.POSITIONAL_ONLY) for p in parameters]
        elif name:
            annotation, _, default = rest.partition(" = \\")
            parameters.append(inspect.Parameter(
                name, kind, annotation=annotation or inspect.Parameter.empty,
                default=defaults[int(default)] if default else inspect.Parameter.empty))
    return inspect.Signature(parameters, return_annotation=text[text.rindex(" -> ") + 4:])


def named(function, answer=None):
    """The function; errors in its arguments name them. `answer` converts what it returns."""

    @functools.wraps(function)
    def call(*args, **kwargs):
        try:
            found = function(*args, **kwargs)
        except TypeError as error:
            if "incompatible function arguments" not in str(error):
                raise
            text = _fault(function.__name__, call.__signature__, args, kwargs)
            raise TypeError(text or str(error)) from None
        return found if answer is None else answer(found)

    call.__signature__ = signature_of(*function.__nb_signature__)
    return call


def name_faults(owner, answers):
    """Puts named() around the compiled functions that a module or a class shows."""
    for name, value in list(vars(owner).items()):
        kind = type(value).__name__
        if name.startswith("_") or kind not in ("nb_func", "nb_method"):
            continue
        if len(value.__nb_signature__) == 1:
            call = named(value, answers.get(name))
            is_static = kind == "nb_func" and inspect.isclass(owner)
            setattr(owner, name, staticmethod(call) if is_static else call)


def refuse(cls, args, kwargs):
    """Raises TypeError for what the constructor of a compiled class does not take."""
    signature = signature_of(vars(cls)["__new__"].__nb_signature__[-2])  # the last one calls this
    parameters = list(signature.parameters.values())[1:]
    text = _fault(cls.__name__, signature.replace(parameters=parameters), args, kwargs)
    raise TypeError(text or f"{cls.__name__}(): it does not take these arguments")


def _fault(name, signature, args, kwargs):
    parameters = signature.parameters
    for keyword in kwargs:
        if keyword not in parameters:
            like = difflib.get_close_matches(keyword, parameters, 1)
            hint = f"did you mean '{like[0]}'?" if like else "it takes " + ", ".join(parameters)
            return f"{name}(): there is no argument '{keyword}'; {hint}"
    by_place = [p.name for p in parameters.values() if p.kind != inspect.Parameter.KEYWORD_ONLY]
    if len(args) > len(by_place):
        return (f"{name}(): {len(args)} arguments without a name; it takes {len(by_place)} ("
                + ", ".join(by_place) + "), all others by name")
    given = dict(zip(by_place, args))
    for keyword in kwargs:
        if keyword in given:
            return f"{name}(): '{keyword}' is given twice"
    given.update(kwargs)
    for parameter in parameters.values():
        if parameter.name not in given:
            if parameter.default is inspect.Parameter.empty:
                return f"{name}(): the argument '{parameter.name}' is missing"
            continue
        value, annotation = given[parameter.name], parameter.annotation
        if annotation in _KINDS:
            wanted, words = _KINDS[annotation]
            if not isinstance(value, wanted):
                return f"{parameter.name}: a {type(value).__name__}; wanted {words}"
            if annotation == "int" and value < 0:
                return f"{parameter.name}: {value}; wanted {words}"
        elif annotation is inspect.Parameter.empty:  # self
            continue
        elif value is None and "None" not in annotation:
            return f"{name}(): the argument '{parameter.name}' is None"
        elif annotation.startswith("ist."):
            wanted = {word.rpartition(".")[2] for word in annotation.split(" | ")}
            kinds = {"None"} if value is None else {kind.__name__ for kind in type(value).__mro__}
            if not kinds & wanted:
                return f"{parameter.name}: a {type(value).__name__}; wanted {annotation}"
    large = [name for name, value in given.items() if parameters[name].annotation == "int"
             and value >= 2**32]
    return f"{large[0]}: {given[large[0]]} is too large" if large else None
