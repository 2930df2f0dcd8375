# realbench with isolation and scene official, for a user without rights.
#   docker build --tag realbench .
#   docker run --rm --volume "$PWD:/work" realbench doctor
# bubblewrap needs namespaces that docker's defaults forbid; without them the kernel's Landlock isolates
# (docs/security.md). To have both: --security-opt seccomp=unconfined --security-opt apparmor=unconfined
# A platform that mounts folders of root's, such as Codabench: --target platform.

FROM python:3.11-slim AS build
RUN apt-get update \
    && apt-get install --yes --no-install-recommends build-essential \
    && rm -rf /var/lib/apt/lists/*
COPY . /source
RUN /source/container/install.sh /opt/realbench

FROM python:3.11-slim AS platform
RUN apt-get update \
    && apt-get install --yes --no-install-recommends bubblewrap \
    && rm -rf /var/lib/apt/lists/*
COPY --from=build /opt/realbench /opt/realbench
COPY container/try.sh /opt/realbench/try.sh
ENV PATH=/opt/realbench/bin:$PATH XDG_DATA_HOME=/opt/realbench/share
WORKDIR /app/program

FROM platform AS realbench
RUN useradd --create-home --uid 1000 player
USER player
WORKDIR /work
ENTRYPOINT ["realbench"]
CMD ["--help"]
