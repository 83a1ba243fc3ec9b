# Sourced by run, test, check, bench, docs and gen: brings a bare Debian or Ubuntu to a working .venv.
# Plain POSIX sh. Nothing is done twice; when everything stands, this costs a few milliseconds.

venv=$root/.venv
certificates=/etc/ssl/certs/ca-certificates.crt

say() {
    printf '%s\n' "$*" >&2
}

fail() {
    say "error: $1"
    shift
    for line in "$@"; do say "       $line"; done
    exit 1
}

# A Python that is new enough and can make environments, or nothing.
find_python() {
    for candidate in python3 python3.14 python3.13 python3.12 python3.11 /usr/bin/python3; do
        if "$candidate" -c 'import sys, ensurepip, venv; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
            command -v "$candidate"
            return
        fi
    done
}

# install_packages NAME...: with apt-get, as root directly, else through sudo.
install_packages() {
    command -v apt-get >/dev/null 2>&1 || fail "missing on this system: $*" \
        "There is no apt-get here; install them by this system's own means (Python must be 3.11 or newer)."
    if [ "$(id -u)" -eq 0 ]; then
        as_root=env
        say "Installing with apt-get: $*"
    elif command -v sudo >/dev/null 2>&1; then
        as_root='sudo env'
        say "Installing with sudo apt-get (it may ask for your password): $*"
    else
        fail "missing on this system: $*" "Neither root nor sudo is at hand. As root, run:" \
            "  apt-get update && apt-get install -y --no-install-recommends $*"
    fi
    log=$(mktemp)
    if ! $as_root DEBIAN_FRONTEND=noninteractive sh -c '
        apt-get update && apt-get install -y --no-install-recommends "$@"' sh "$@" >"$log" 2>&1; then
        cat "$log" >&2
        rm -f "$log"
        fail "apt-get could not install: $*" "Its own words stand above."
    fi
    rm -f "$log"
}

provide_system() {
    missing=
    [ -n "$(find_python)" ] || missing='python3 python3-venv'
    [ -s "$certificates" ] || missing="$missing ca-certificates"
    # shellcheck disable=SC2086  # a list of words
    [ -z "$missing" ] || install_packages $missing
    python=$(find_python)
    [ -n "$python" ] || fail "Python 3.11 or newer is needed" \
        "This system offers $(python3 --version 2>&1). Debian 12 and Ubuntu 24.04 are new enough."
}

# provide_clients: .venv-clients holds foreign software that talks to Galil controllers, at the versions and hashes of
# its lock, and finds this project's source by a path file; tests/system/test_foreign_clients.py runs it.
provide_clients() {
    clients=$root/.venv-clients
    made_from=$(printf '%s\n' "$root" && cksum "$root/requirements-clients.lock")
    if [ -f "$clients/stamp" ] && [ "$(cat "$clients/stamp")" = "$made_from" ]; then
        return
    fi
    provide_system
    say "Setting up .venv-clients (once; about a minute) ..."
    rm -rf "$clients"
    "$python" -m venv "$clients"
    pip="$clients/bin/python -m pip --disable-pip-version-check --quiet"
    name_certificates
    $pip install --require-hashes --only-binary :all: --no-deps -r "$root/requirements-clients.lock"
    printf '%s\n' "$root/src" >"$("$clients/bin/python" -c 'import sysconfig; print(sysconfig.get_paths()["purelib"])')/maya-un.pth"
    printf '%s\n' "$made_from" >"$clients/stamp"
}

# provide_command NAME: a program that is a Debian package of the same name.
provide_command() {
    command -v "$1" >/dev/null 2>&1 || install_packages "$1"
}

# What an environment was made from; a change of any of it makes the environment anew.
fingerprint() {
    printf '%s\n' "$root"
    cksum "$root/pyproject.toml" "$root/$1"
}

stands() {
    [ -x "$venv/bin/python" ] && [ -f "$venv/stamp-$1" ] && [ "$(cat "$venv/stamp-$1")" = "$(fingerprint "$1")" ]
}

# Where neither pip's configuration nor the surroundings name certificates, the system's are taken: a site may
# have added its own to them.
name_certificates() {
    if [ -z "${PIP_CERT-}${REQUESTS_CA_BUNDLE-}" ] && ! $pip config get global.cert >/dev/null 2>&1; then
        PIP_CERT=$certificates
        export PIP_CERT
    fi
}

# provide_environment LOCK: .venv holds the packages of LOCK, each with the hash that stands there, and this
# project, editable. The development lock contains the run-time one, so an environment made for it serves both.
provide_environment() {
    if stands requirements-dev.lock || stands "$1"; then
        return
    fi
    provide_system
    say "Setting up .venv from $1 (once; about a minute) ..."
    if ! stands requirements.lock; then
        rm -rf "$venv"
        "$python" -m venv "$venv"
    fi
    pip="$venv/bin/python -m pip --disable-pip-version-check --quiet"
    name_certificates
    $pip install --require-hashes --only-binary :all: -r "$root/$1"
    $pip install --no-deps --no-build-isolation -e "$root"
    fingerprint "$1" >"$venv/stamp-$1"
}
