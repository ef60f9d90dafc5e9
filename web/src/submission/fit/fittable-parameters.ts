/** Parameters of a robot that can be fitted: from the catalogue, or from the check of a custom robot. */

import { post } from '../../api/client'
import { useResource } from '../../api/resource'
import type { RobotPreset } from '../../api/types'
import type { Catalogue } from '../draft/catalogue'
import type { RobotDraft } from '../draft/draft'

export type FittableParameters = Pick<RobotPreset, 'parameters' | 'conventions'>

export function useFittableParameters(
  robot: RobotDraft,
  { robots }: Catalogue,
): FittableParameters {
  const isCustom = robot.kind === 'files' && robot.toml !== '' && robot.urdf !== ''
  const { toml, urdf } = robot
  const checked = useResource(isCustom ? `${toml} ${urdf}` : null, (signal) =>
    post('/v1/robots/checks', { body: { toml, urdf }, signal }),
  )
  const shipped = robots.find(({ name }) => name === robot.name) ?? robots[0]
  if (robot.kind !== 'files') return shipped
  return { parameters: checked.data?.parameters ?? [], conventions: shipped.conventions }
}
