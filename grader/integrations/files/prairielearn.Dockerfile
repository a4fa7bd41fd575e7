# The image of an external grader for PrairieLearn: `docker build -t NAME .` here. One serves every lab.
FROM debian:12-slim
COPY system.sh /opt/ros-lab-grader-setup/
RUN bash /opt/ros-lab-grader-setup/system.sh --system-only && rm -rf /var/lib/apt/lists/*
COPY *.whl /opt/ros-lab-grader-setup/
RUN python3 -m venv /opt/ros-lab-grader && /opt/ros-lab-grader/bin/python -m pip install --quiet --no-cache-dir --disable-pip-version-check /opt/ros-lab-grader-setup/*.whl && rm -r /opt/ros-lab-grader-setup
COPY grade-question /usr/local/bin/grade-question
ENTRYPOINT ["/usr/local/bin/grade-question"]
