# The grader with ROS 1, for a machine that has neither:
#     docker build -t ros-lab-grader .
#     docker run --rm -v "$PWD:/work" ros-lab-grader check
# `--build-arg EXTRAS=review,similarity` adds parts of the grader that only a course's staff needs.
FROM debian:12-slim

COPY scripts/setup.sh /tmp/grader/scripts/setup.sh
RUN bash /tmp/grader/scripts/setup.sh --system-only && rm -rf /var/lib/apt/lists/*

ARG EXTRAS=""
COPY . /tmp/grader
RUN python3 -m venv /opt/ros-lab-grader && \
    /opt/ros-lab-grader/bin/python -m pip install --quiet --no-cache-dir --disable-pip-version-check \
        "/tmp/grader${EXTRAS:+[$EXTRAS]}" && \
    rm -rf /tmp/grader

# Who grades is not root. The home may be written by any user, so that `docker run --user` works, too.
RUN useradd --uid 1000 --create-home grader && chmod 1777 /home/grader && mkdir /work && chown grader /work
ENV PATH=/opt/ros-lab-grader/bin:$PATH HOME=/home/grader LANG=C.UTF-8
USER grader
WORKDIR /work
ENTRYPOINT ["grader"]
CMD ["--help"]
