/** What a spec's robot is: one that ships, or one of one's own, by its files. */

import type { JobSpec } from './types'

/**
 * Whether the published designs and the preset scenarios are this robot's: they are of Szabadka-II
 * and its variants; a robot of one's own has its own scenarios, and nobody published a design of it.
 */
export function isPublished(robot: JobSpec['robot'] | undefined): boolean {
  return robot === undefined || typeof robot === 'string' || !('toml' in robot)
}

export const NOT_PUBLISHED = 'This robot has no published design.'
