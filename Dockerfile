# A small image of the server: the program, built with its viewer, a C library and certificates of authorities.
#
#   docker build -t belvedere .
#   docker run -p 8080:8080 -v belvedere:/data belvedere
#
# The data folder is a volume. A bake of an upload runs inside of the same container, so its memory counts here.

FROM node:22-bookworm-slim AS viewer
WORKDIR /src/viewer
COPY viewer/package.json viewer/package-lock.json viewer/.npmrc ./
RUN npm ci --no-audit --no-fund
COPY viewer .
COPY content/person.dcg /src/content/
RUN npm run build

FROM rust:1.94-bookworm AS program
WORKDIR /src
COPY . .
COPY --from=viewer /src/viewer/dist viewer/dist
RUN cargo build --release --locked --bin belvedere

FROM debian:bookworm-slim
# Whom to trust when a bucket or a database is asked over TLS.
RUN apt-get update && apt-get install --yes --no-install-recommends ca-certificates && rm -rf /var/lib/apt/lists/*
RUN useradd --system --uid 10001 --no-create-home belvedere && install -d -o belvedere -g belvedere /data
COPY --from=program /src/target/release/belvedere /usr/local/bin/belvedere
USER 10001
VOLUME /data
ENV BELVEDERE_DATA=/data BELVEDERE_LISTEN=0.0.0.0:8080 BELVEDERE_LOG_FORMAT=json
EXPOSE 8080
# The image has no curl; bash speaks enough HTTP for this, and where the server speaks TLS, an alert (15 03) in return says that it is
# there. Not /readyz: whoever restarts what is unhealthy would do so while the database is away, and what is known is served then.
HEALTHCHECK --interval=10s --timeout=3s --start-period=10s CMD ["bash", "-c", \
    "exec 3<>/dev/tcp/127.0.0.1/8080 && printf 'GET /healthz HTTP/1.0\\r\\n\\r\\n' >&3 && head -1 <&3 | LC_ALL=C grep -aqe ' 200 ' -e $'^\\x15\\x03'"]
# Open streams end at once when it is asked to stop; drain time is in the settings.
STOPSIGNAL SIGTERM
ENTRYPOINT ["belvedere"]
CMD ["serve"]
