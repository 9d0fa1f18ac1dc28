# The workflow, with the versions of requirements.lock:
#   docker build --tag damper . && docker run --rm --volume "$PWD/results:/damper/results" damper
FROM python:3.13-slim
WORKDIR /damper
COPY requirements.lock ./
RUN python3 -m venv .venv
RUN .venv/bin/pip install --require-hashes --no-cache-dir -r requirements.lock
COPY pyproject.toml README.md LICENSE Snakefile ./
COPY config config
COPY profiles profiles
COPY src src
COPY workflow workflow
RUN .venv/bin/pip install --no-deps --no-cache-dir -e .
ENV PATH=/damper/.venv/bin:$PATH
CMD ["snakemake", "--cores", "all"]
