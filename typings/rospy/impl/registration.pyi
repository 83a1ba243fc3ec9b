class Registration:
    SUB: str
