/** Provenance of a job's numbers, by iteration. */

import type { Job } from '../../api/types'
import { HistoryCheck } from './history-check'

/** Digits of a digest that are shown. */
const SHOWN = 8

export function ProvenanceCard({ job }: { job: Job }) {
  return (
    <section class="card" aria-labelledby="provenance">
      <h2 id="provenance">Provenance</h2>
      {job.provenance.length === 0 ? (
        <p class="muted small">Unknown: the job was stored by a version that did not record it.</p>
      ) : (
        <div class="table-scroll">
          <table>
            <caption class="visually-hidden">Provenance by iteration</caption>
            <thead>
              <tr>
                <th scope="col">From iteration</th>
                <th scope="col">gaitswarm</th>
                <th scope="col">Backend</th>
                <th scope="col">Robot</th>
                <th scope="col">Simulation code</th>
                <th scope="col">Search code</th>
                <th scope="col">Libraries</th>
              </tr>
            </thead>
            <tbody>
              {job.provenance.map(({ from_iteration, provenance }, index) => (
                <tr key={index} data-from-iteration={from_iteration}>
                  <td>{from_iteration}</td>
                  <td>{provenance.gaitswarm}</td>
                  <td>
                    {provenance.simulation.backend}, {provenance.simulation.precision}
                  </td>
                  <td>
                    {provenance.simulation.robot}{' '}
                    <Digest digits={provenance.simulation.robot_digest} />
                  </td>
                  <td>
                    <Digest digits={provenance.simulation.code_digest} />
                  </td>
                  <td>
                    <Digest digits={provenance.optimizer_digest} />
                  </td>
                  <td>{libraries(provenance.simulation.libraries)}</td>
                </tr>
              ))}
            </tbody>
          </table>
        </div>
      )}
      {job.iterations > 0 && <HistoryCheck job={job} />}
    </section>
  )
}

function Digest({ digits }: { digits: string }) {
  return <code title={digits}>{digits.slice(0, SHOWN)}</code>
}

function libraries(versions: Record<string, string>): string {
  return Object.entries(versions)
    .map(([name, version]) => `${name} ${version}`)
    .join(', ')
}
