/** Shell commands that submit a job's spec. */

/** Write the spec to a file and submit it with the command line. */
export function submitCommand(spec: object, server: string): string {
  const file = `cat > job.json <<'END'\n${JSON.stringify(spec, null, 1)}\nEND`
  return `${file}\ngaitswarm submit --spec job.json --server ${server}`
}

/** The same with curl. */
export function curlCommand(spec: object, server: string): string {
  const body = quoted(JSON.stringify(spec))
  return `curl -s -X POST ${server}/v1/jobs -H 'Content-Type: application/json' -d ${body}`
}

/** Quote a string for a POSIX shell. */
export function quoted(text: string): string {
  return `'${text.replaceAll("'", `'\\''`)}'`
}
