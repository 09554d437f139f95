from protocol import VERBS, Angle, ErrorCode, Ok, Verb


def test_the_verb_table_is_table_1_of_the_paper() -> None:
    assert [(str(verb), entry.takes_number, entry.reply) for verb, entry in VERBS.items()] == [
        ("H", False, Angle),
        ("L", False, Angle),
        ("P", True, Ok),
        ("R", True, Ok),
        ("S", True, Ok),
        ("A", True, Ok),
    ]


def test_every_verb_has_its_row() -> None:
    assert set(VERBS) == set(Verb)


def test_errors_have_their_words() -> None:
    assert [f"{code} {code.text}" for code in ErrorCode] == [
        "1 unknown command",
        "2 bad number",
        "3 out of range",
        "4 line too long",
        "5 bad byte",
    ]
