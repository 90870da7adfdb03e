# The command nectosome as an image; it works in /work, with the packages of requirements/run.lock:
#   docker build -t nectosome .
#   docker run --rm --user "$(id -u):$(id -g)" -v "$PWD:/work" nectosome simulate turtle --time 2s --save turtle.nc
FROM python:3.13-slim-bookworm AS build
WORKDIR /source
COPY requirements/run.lock requirements/
RUN python -m venv /opt/nectosome \
    && /opt/nectosome/bin/pip install --no-cache-dir --require-hashes -r requirements/run.lock
COPY . .
RUN /opt/nectosome/bin/pip install --no-cache-dir --no-deps . ./studies

FROM python:3.13-slim-bookworm
COPY --from=build /opt/nectosome /opt/nectosome
ENV PATH=/opt/nectosome/bin:$PATH NECTOSOME_CACHE=/tmp/nectosome
RUN useradd --uid 1000 --create-home nectosome && mkdir /work && chown nectosome /work
USER 1000
WORKDIR /work
ENTRYPOINT ["nectosome"]
CMD ["--help"]
