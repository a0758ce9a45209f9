# make run in a container: docker build -t carrierflex . && docker run --rm -v "$PWD/out:/carrierflex/out" carrierflex
ARG BASE=debian:12
FROM ${BASE}
RUN apt-get update \
    && apt-get install -y --no-install-recommends ca-certificates git make python3 python3-venv \
    && rm -rf /var/lib/apt/lists/*
WORKDIR /carrierflex
COPY . .
RUN make install
CMD ["make", "run"]
