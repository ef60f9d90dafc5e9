/** Files of a robot as they are chosen: text, or what is wrong with them. */

/** Of any file of a robot [B]: the API takes less, and says how much. */
const MOST_BYTES = 4_000_000

/** The text of a file. Throws with what is wrong and the way out. */
export async function textOf(file: File): Promise<string> {
  if (file.size > MOST_BYTES) {
    throw new Error(
      `${file.name} has ${(file.size / 1e6).toFixed(1)} MB; a robot's files are text of at most` +
        ' 0.8 MB. Choose the URDF itself: it names its meshes, which no walk needs',
    )
  }
  let bytes: ArrayBuffer
  try {
    bytes = await file.arrayBuffer()
  } catch {
    throw new Error(`${file.name} cannot be read; it may have changed meanwhile: choose it again`)
  }
  try {
    return new TextDecoder('utf-8', { fatal: true }).decode(bytes)
  } catch {
    throw new Error(`${file.name} is not UTF-8 text; choose another file, or save it as UTF-8`)
  }
}

/** A name for a robot, by the name of its file: what may name one of it, or else `robot`. */
export function robotName(file: string): string {
  const stem = file.replace(/\.[^.]*$/, '')
  const allowed = stem.replace(/[^\p{L}\p{N}_. -]/gu, '').replace(/^[^\p{L}\p{N}_]+/u, '')
  return allowed.slice(0, 100).trim() || 'robot'
}
