from signal import (
    SIGINT as SIGINT,
    default_int_handler as default_int_handler,
    getsignal as getsignal,
    signal as signal,
)
