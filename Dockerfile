# One image for server, runner, Ray head and Ray workers.

FROM python:3.13-slim-bookworm AS code
ENV PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_CACHE_DIR=1 PIP_ROOT_USER_ACTION=ignore
RUN python -m venv /opt/gaitswarm
ENV PATH=/opt/gaitswarm/bin:$PATH
# The dependencies first: they change less often than the code.
COPY requirements/image.lock /src/requirements/
RUN pip install --no-deps --require-hashes --only-binary :all: -r /src/requirements/image.lock
COPY pyproject.toml README.md /src/
COPY sim /src/sim
COPY services /src/services
COPY gaitswarm /src/gaitswarm
COPY api /src/api
COPY cli /src/cli
RUN cd /src && python -m gaitswarm.api.document > /openapi.json

FROM node:24-bookworm-slim AS page
# The packages first, as above.
COPY web/package.json web/package-lock.json web/.npmrc /src/web/
RUN cd /src/web && npm ci
COPY web /src/web
COPY --from=code /openapi.json /src/web/openapi.json
RUN cd /src/web && npm run types && npm run build

FROM code AS manual
COPY requirements/manual.lock /src/requirements/
RUN pip install --no-deps --require-hashes --only-binary :all: -r /src/requirements/manual.lock
COPY ARCHITECTURE.md CHANGELOG.md /src/
COPY docs /src/docs
COPY research/README.md /src/research/
COPY research/docs /src/research/docs
COPY examples /src/examples
COPY scripts/manual /src/scripts/manual
RUN cd /src && python -m sphinx -q -b html -d /tmp/manual -c docs . api/manual

FROM code AS build
# Kernels for every level of this architecture, whatever machine builds the image.
RUN apt-get update && apt-get install --yes --no-install-recommends gcc libc6-dev
COPY scripts/prebuilt.py /src/scripts/
RUN cd /src && python -m scripts.prebuilt
COPY --from=page /src/api/page /src/api/page
COPY --from=manual /src/api/manual /src/api/manual
RUN pip install --no-deps --no-build-isolation /src

FROM python:3.13-slim-bookworm
# The compiler stays for other robots.
RUN apt-get update \
    && apt-get install --yes --no-install-recommends gcc libc6-dev \
    && rm -rf /var/lib/apt/lists/* \
    && useradd --system --uid 10001 --create-home --home-dir /var/lib/gaitswarm gaitswarm \
    && install --directory --owner gaitswarm --group gaitswarm /var/cache/gaitswarm
COPY --from=build /opt/gaitswarm /opt/gaitswarm
ENV PATH=/opt/gaitswarm/bin:$PATH \
    PYTHONUNBUFFERED=1 \
    PYTHONDONTWRITEBYTECODE=1 \
    XDG_CACHE_HOME=/var/cache/gaitswarm \
    MPLCONFIGDIR=/tmp/matplotlib \
    RAY_USAGE_STATS_ENABLED=0 \
    GAITSWARM_DB=/var/lib/gaitswarm/gaitswarm.db \
    GAITSWARM_API_HOST=0.0.0.0
USER gaitswarm
WORKDIR /var/lib/gaitswarm
RUN python -c "from gaitswarm.sim.simulate import prepare; print('kernel:', prepare())"
EXPOSE 8000
VOLUME /var/lib/gaitswarm
HEALTHCHECK --interval=10s --timeout=5s --start-period=30s --retries=3 \
    CMD ["python", "-c", "import urllib.request as u; u.urlopen('http://127.0.0.1:8000/v1/readyz', timeout=4)"]
CMD ["gaitswarm", "serve"]
