/** The search method of a job, with the settings that are not its defaults. */

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
                <Row key={key} name={key} value={value} usual={usualOf(method, key)} />
              ))}
            </tbody>
          </table>
        </div>
      </div>
    </section>
  )
}

function Row({ name, value, usual }: { name: string; value: string; usual: string | null }) {
  const changed = usual !== null && usual !== value
  return (
    <tr data-setting={name} data-changed={changed}>
      <th scope="row">{inWords(name)}</th>
      <td>{changed ? <strong>{value}</strong> : value}</td>
      <td>{changed ? usual : <span class="muted">{usual === null ? '' : 'the same'}</span>}</td>
    </tr>
  )
}

/** null while it is not known. */
function usualOf(method: OptimizerPreset | undefined, setting: string): string | null {
  if (!method) return null
  return settingText(new Map<string, unknown>(Object.entries(method.settings)).get(setting))
}

function settingsOf({ spec }: Job): object {
  return typeof spec.optimizer === 'object' ? spec.optimizer : {}
}
