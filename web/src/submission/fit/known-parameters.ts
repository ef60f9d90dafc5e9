/** What may be fitted of a robot: of one that ships from the catalogue, of one's own as it is checked. */

import { post } from '../../api/client'
import { useResource } from '../../api/resource'
import type { RobotPreset } from '../../api/types'
import type { Catalogue } from '../draft/catalogue'
import type { RobotDraft } from '../draft/draft'

export type KnownParameters = Pick<RobotPreset, 'parameters' | 'conventions'>

export function useKnownParameters(robot: RobotDraft, { robots }: Catalogue): KnownParameters {
  const own = robot.kind === 'files' && robot.toml !== '' && robot.urdf !== ''
  const { toml, urdf } = robot
  const checked = useResource(own ? `${toml} ${urdf}` : null, (signal) =>
    post('/v1/robots/checks', { body: { toml, urdf }, signal }),
  )
  const shipped = robots.find(({ name }) => name === robot.name) ?? robots[0]
  if (robot.kind !== 'files') return shipped
  return { parameters: checked.data?.parameters ?? [], conventions: shipped.conventions }
}
