"""Programs in the controller: threads, flow, waits, automatic subroutines."""
