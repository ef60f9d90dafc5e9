/** Shell commands that submit a job's spec once more. */

/** Writes the spec to a file and submits it with the command line. */
export function submitCommand(spec: object, server: string): string {
  const file = `cat > job.json <<'END'\n${JSON.stringify(spec, null, 1)}\nEND`
  return `${file}\ngaitswarm submit --spec job.json --server ${server}`
}

/** The same with curl alone. */
export function curlCommand(spec: object, server: string): string {
  const body = quoted(JSON.stringify(spec))
  return `curl -s -X POST ${server}/v1/jobs -H 'Content-Type: application/json' -d ${body}`
}

/** A string as one word of a POSIX shell. */
export function quoted(text: string): string {
  return `'${text.replaceAll("'", `'\\''`)}'`
}
