from genpy import Message

class TCPROSSub:
    def __init__(self, resolved_name: str, recv_data_class: type[Message]) -> None: ...
