# Sourced after served.sh. `behind_nginx CONF [LINE]` starts an nginx in front of the server, set up as a file of deploy/ says, with a
# line before everything else, and waits until it answers at $cdn.
free_port() { python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])'; }

behind_nginx() {
  local port
  port=$(free_port)
  # The workers of an nginx that root starts are somebody else.
  chmod 755 "$work"
  mkdir -p "$work/nginx" "$work/logs"
  sed -e "s|/etc/nginx/belvedere|$work/nginx|; s|/var/cache/nginx|$work|; s|/var/log/nginx|$work/logs|" \
    -e "s|listen 8081|listen 127.0.0.1:$port|; s|server 127.0.0.1:8080|server ${base#http://}|" \
    "$1" >"$work/nginx/site.conf"
  cat >"$work/nginx.conf" <<END
${2:-}
worker_processes 1;
daemon off;
pid $work/nginx.pid;
error_log $work/logs/error.log;
events { worker_connections 256; }
http {
  client_body_temp_path $work/body; proxy_temp_path $work/proxy; fastcgi_temp_path $work/f; uwsgi_temp_path $work/u; scgi_temp_path $work/s;
  include $work/nginx/site.conf;
}
END
  nginx -c "$work/nginx.conf" -p "$work" &
  also_end $!
  cdn="http://127.0.0.1:$port"
  for _ in $(seq 100); do curl -s -o /dev/null "$cdn/healthz" && break; sleep 0.1; done
}
