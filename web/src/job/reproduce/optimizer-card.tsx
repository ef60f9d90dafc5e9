/** Search method of a job and its settings. */

import { get } from '../../api/client'
import { useResource } from '../../api/resource'
import type { Job, OptimizerPreset } from '../../api/types'
import { inWords, sentence } from '../../format/words'
import { methodNamed, settingText, settingTexts } from '../../submission/draft/optimizer'

export function OptimizerCard({ job }: { job: Job }) {
  const catalogue = useResource('optimizers', (signal) => get('/v1/optimizers', { signal }))
  const name = job.optimizer ?? ''
  const method = methodNamed(catalogue.data?.items ?? [], name)
  const settings = Object.entries(settingTexts(settingsOf(job))).filter(([key]) => key !== 'name')
  return (
    <section class="card" aria-labelledby="optimizer">
      <h2 id="optimizer">Search method: {name}</h2>
      <div class="stack-tight">
        {method && <p class="muted small">{sentence(method.description)}</p>}
        <div class="table-scroll">
          <table>
            <caption class="visually-hidden">Settings of the search method</caption>
            <thead>
              <tr>
                <th scope="col">Setting</th>
                <th scope="col">Value</th>
                <th scope="col">Default</th>
              </tr>
            </thead>
            <tbody>
              {settings.map(([key, value]) => (
                <Row key={key} name={key} value={value} defaultValue={defaultOf(method, key)} />
              ))}
            </tbody>
          </table>
        </div>
      </div>
    </section>
  )
}

function Row({
  name,
  value,
  defaultValue,
}: {
  name: string
  value: string
  defaultValue: string | null
}) {
  const changed = defaultValue !== null && defaultValue !== value
  return (
    <tr data-setting={name} data-changed={changed}>
      <th scope="row">{inWords(name)}</th>
      <td>{changed ? <strong>{value}</strong> : value}</td>
      <td>
        {changed ? (
          defaultValue
        ) : (
          <span class="muted">{defaultValue === null ? '' : 'the same'}</span>
        )}
      </td>
    </tr>
  )
}

/** null if unknown. */
function defaultOf(method: OptimizerPreset | undefined, setting: string): string | null {
  if (!method) return null
  return settingText(new Map<string, unknown>(Object.entries(method.settings)).get(setting))
}

function settingsOf({ spec }: Job): object {
  return typeof spec.optimizer === 'object' ? spec.optimizer : {}
}
