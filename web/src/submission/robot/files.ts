/** Reading of a robot's files. */

/** Size limit for any file [B]; the API has lower limits and reports them. */
const MOST_BYTES = 4_000_000

/** Read a text file. Throws a message for the user. */
export async function textOf(file: File): Promise<string> {
  if (file.size > MOST_BYTES) {
    throw new Error(
      `${file.name} has ${(file.size / 1e6).toFixed(1)} MB; robot files are text of at most 0.8 MB.` +
        ' Choose the URDF itself; meshes are not needed',
    )
  }
  let bytes: ArrayBuffer
  try {
    bytes = await file.arrayBuffer()
  } catch {
    throw new Error(`cannot read ${file.name}; it may have changed: choose it again`)
  }
  try {
    return new TextDecoder('utf-8', { fatal: true }).decode(bytes)
  } catch {
    throw new Error(`${file.name} is not UTF-8 text; choose another file, or save it as UTF-8`)
  }
}

/** Name of a robot derived from its file name, restricted to allowed characters. */
export function robotName(file: string): string {
  const stem = file.replace(/\.[^.]*$/, '')
  const allowed = stem.replace(/[^\p{L}\p{N}_. -]/gu, '').replace(/^[^\p{L}\p{N}_]+/u, '')
  return allowed.slice(0, 100).trim() || 'robot'
}
